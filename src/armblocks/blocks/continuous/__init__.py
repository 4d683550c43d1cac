"""Blocks with continuous states: integrators, linear systems, controllers, transport delays."""
