"""The protocol between front end and server (messages, frames of samples), and the connected clients."""
