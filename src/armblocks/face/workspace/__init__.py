"""The workspace of an arm: sampling, the result, its pictures and files."""
