"""The drive: tables of vehicles, legs, states and movements, and the steps that compiled code makes over them."""
