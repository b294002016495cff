"""The command line: thin; every command calls the package and prints."""
