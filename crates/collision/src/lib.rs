//! Whether an arm touches anything: itself, its surroundings, what it carries; now and along a trajectory.
