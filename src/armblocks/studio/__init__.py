"""The studio: editing and running of diagrams in the browser."""
