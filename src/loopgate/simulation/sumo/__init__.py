"""Files and options that SUMO is given to start with, and the room that it takes on the disk."""
