"""The studio: diagrams drawn, run and watched in the browser."""
