//! Where a suction cup can hold an object: graspable patches of two views, put in correspondence and ranked.
