"""The web server: access control, request handling, start and end of the program."""
