"""What SUMO is given to start with, and what it leaves on the disk."""
