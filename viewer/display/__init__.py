"""What stands on the screen: pictures of the scene, and of what is inspected."""
