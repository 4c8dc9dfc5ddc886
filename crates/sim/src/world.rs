//! World files.
