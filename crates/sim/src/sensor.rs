//! From radiance to digital numbers.
