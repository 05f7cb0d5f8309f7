"""`khala mcp`: an MCP client plays an agent of a match, with tools.

    table     a match whose seats are played by sessions, each at its own pace
    words     what a player reads
    holder    which client plays a seat
    server    one seat as an MCP server: tools, and resources
    serve     the servers of a match over stdio or streamable HTTP
    cli       the command

It needs the extra `mcp`, the official SDK. Below it: `khala_sc2.playing.seats`.
"""
