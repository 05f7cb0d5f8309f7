"""`khala view`: one page with one clock, on which people see what happened in a match, live or afterwards."""
