"""The web server: connections, keys, requests, the life of the program."""
