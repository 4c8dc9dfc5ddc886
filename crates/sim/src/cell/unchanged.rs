//! What of a world stays as long as its cell runs.

use crate::SimError;
use crate::world::{Camera, World};

pub(super) fn check(world: &World, old: &World) -> Result<(), SimError> {
    for (camera, old) in world.cameras.iter().zip(&old.cameras) {
        check_camera(camera, old)?;
    }
    if world.lights.port != old.lights.port {
        return Err(stays("lights.port", &world.lights.port, &old.lights.port));
    }
    if world.arm != old.arm {
        return Err(stays("arm", &world.arm, &old.arm));
    }
    Ok(())
}

fn check_camera(camera: &Camera, old: &Camera) -> Result<(), SimError> {
    let within = |error: SimError| error.within(&format!("cameras.{}", camera.name));
    let size = |camera: &Camera| [camera.lens.width(), camera.lens.height()];
    if camera.address != old.address {
        return Err(within(stays("address", camera.address, old.address)));
    }
    if camera.serial != old.serial {
        return Err(within(stays("serial", &camera.serial, &old.serial)));
    }
    if size(camera) != size(old) {
        return Err(within(stays("width and height", size(camera), size(old))));
    }
    if camera.trigger_line != old.trigger_line {
        return Err(within(stays("trigger_line", camera.trigger_line, old.trigger_line)));
    }
    Ok(())
}

fn stays<T: std::fmt::Debug>(place: &str, found: T, old: T) -> SimError {
    SimError::value(place, format!("{found:?}"), format!("{old:?} as long as the cell runs"))
}
