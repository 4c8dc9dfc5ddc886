//! The node that turns a capture's images into a normal map.
