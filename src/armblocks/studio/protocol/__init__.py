"""What front end and server say to each other (messages, frames of samples), and the connected pages."""
