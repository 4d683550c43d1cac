"""Blocks of comparisons, logic, edges, flip-flops and counters."""
