"""Blocks that compute at the ticks of a clock: delays, filters, sampled linear systems and controllers."""
