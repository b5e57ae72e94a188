"""`python -m viewer` is `iibr`."""

from viewer.cli.main import main

if __name__ == "__main__":
    main()
