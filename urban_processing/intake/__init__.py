"""What a shell has read, made ready for the engine; which program read it does not matter."""
