"""Linear systems and operating points: what is worked out of a system's equations and their derivatives."""
