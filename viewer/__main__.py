"""`python -m viewer` is `iibr`."""

from viewer.entry import command

if __name__ == "__main__":
    command()
