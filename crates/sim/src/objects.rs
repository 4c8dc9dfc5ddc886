//! Objects made by code or read from mesh files.
