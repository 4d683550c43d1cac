"""The web server: keys, requests, the life of the program."""
