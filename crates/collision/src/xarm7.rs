//! What the maker of the xArm7 says about its links.

/// Links of the xArm7 and its vacuum gripper that never touch each other, beside neighbours: the pairs its maker's
/// semantic robot description (SRDF) turns off, those of its gripper for the gripper's cup as well. The names are those of
/// `urdf/xarm7.urdf`.
pub const XARM7_NEVER_TOUCHING: [[&str; 2]; 16] = [
    ["link1", "link3"],
    ["link1", "link4"],
    ["link_base", "link2"],
    ["link_base", "link3"],
    ["link3", "link5"],
    ["link3", "link6"],
    ["link3", "link7"],
    ["link4", "link6"],
    ["link4", "link7"],
    ["link5", "link7"],
    ["vacuum_gripper", "link3"],
    ["vacuum_gripper", "link6"],
    ["vacuum_gripper", "link7"],
    ["vacuum_cup", "link3"],
    ["vacuum_cup", "link6"],
    ["vacuum_cup", "link7"],
];
