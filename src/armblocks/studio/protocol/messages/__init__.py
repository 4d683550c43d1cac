"""All messages between front end and server, one file for each subject, found by their folder."""
