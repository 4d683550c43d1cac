"""Blocks whose output has kinks or jumps: limits, relays, quantizers, dry friction, rate limits."""
