"""Linear systems and operating points, from a system's equations and their derivatives."""
