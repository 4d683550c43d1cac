"""Readable equations: sums of products of symbols and of sines and cosines of sums of joint angles."""
