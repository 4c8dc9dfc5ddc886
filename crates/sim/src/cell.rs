//! The world, its cameras and its lights, together.
