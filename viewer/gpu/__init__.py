"""Everything that touches OpenGL: contexts, programs, textures, the renderer. Nothing else imports moderngl."""
