"""`python -m khala` is `khala`."""

from khala.cli import main

if __name__ == "__main__":
    main()
