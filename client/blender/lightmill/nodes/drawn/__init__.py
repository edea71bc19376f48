"""What only Cycles can tell, by a second Blender: pictures of worlds, of lamps, and textures of volumes."""
