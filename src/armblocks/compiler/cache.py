"""temporary"""

import hashlib


def object_name(parts):
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def load_object(name):
    return None


def store_object(name, code):
    return None
