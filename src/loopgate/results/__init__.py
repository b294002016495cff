"""What a run leaves behind: its folder, its columns, its summary."""
