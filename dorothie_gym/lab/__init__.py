"""People in the browser: the console, studies and annotation."""
