"""Methods that integrate a system, and the native loop around them."""
