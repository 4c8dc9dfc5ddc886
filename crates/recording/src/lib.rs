//! MCAP bags of the cell: reading what others wrote and writing what others read.
