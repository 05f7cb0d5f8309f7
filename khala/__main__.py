"""`python -m khala` is `khala`, and what `khala.playing.children` starts."""

if __name__ == "__main__":
    from khala_protocol.parent_watch import end_with_parent

    end_with_parent()  # before the imports of half a second in which the parent may die
    from khala.cli import main

    main()
