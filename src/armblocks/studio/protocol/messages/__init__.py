"""Every message between front end and server: one file a subject, each found by its place in this folder."""
