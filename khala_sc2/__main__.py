"""`python -m khala_sc2` is `khala`, and what `khala_sc2.playing.children` starts."""

if __name__ == "__main__":
    from khala_protocol.parent_watch import end_with_parent

    end_with_parent()  # before the imports of half a second in which the parent may die
    from khala_sc2.cli import main

    main()
