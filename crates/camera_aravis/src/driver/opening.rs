//! From a camera's name to a camera under our control.

use aravis::glib::object::Cast;
use aravis::prelude::*;
use aravis::{Camera, Device, DeviceError, GvDevice, RangeCheckPolicy};
use devices::CameraIdentity;
use gige_vision::bootstrap as at;

use crate::{CameraConfig, discovery};

/// A camera that obeys us.
pub(super) struct Opened {
    pub(super) camera: Camera,
    pub(super) device: Device,
    pub(super) identity: CameraIdentity,
}

/// Opens the camera and takes control; the reason why not is for people.
pub(super) fn open(config: &CameraConfig) -> Result<Opened, String> {
    let address = match config.address() {
        Some(address) => address.to_string(),
        None => discovery::find(&config.guid).map_err(|error| error.to_string())?,
    };
    let camera = Camera::new(Some(&address)).map_err(|error| cannot_open(&address, &error))?;
    let device = camera.device().ok_or("Aravis gives no device")?;
    let controls = device.downcast_ref::<GvDevice>().map(GvDevice::is_controller);
    match controls {
        None => return Err(format!("{address} is no GigE Vision camera")),
        Some(false) => return Err(format!("another client holds control of the camera at {address}")),
        Some(true) => {}
    }
    camera.set_range_check_policy(RangeCheckPolicy::Enable);
    let identity = identify(&camera, address).map_err(|error| format!("it does not say who it is: {error}"))?;
    let millis = config.heartbeat.as_millis() as u32;
    device
        .write_register(u64::from(at::HEARTBEAT_TIMEOUT), millis)
        .map_err(|error| format!("heartbeat = {millis} ms is refused: {error}"))?;
    Ok(Opened {
        camera,
        device,
        identity,
    })
}

fn cannot_open(address: &str, error: &aravis::glib::Error) -> String {
    match error.kind::<DeviceError>() {
        Some(DeviceError::NotFound) => format!("no camera answers at {address}"),
        Some(DeviceError::ProtocolErrorAccessDenied) => {
            format!("another client holds exclusive control of the camera at {address}")
        }
        _ => format!("the camera at {address} does not open: {error}"),
    }
}

fn identify(camera: &Camera, address: String) -> Result<CameraIdentity, aravis::glib::Error> {
    Ok(CameraIdentity {
        vendor: camera.vendor_name()?.into(),
        model: camera.model_name()?.into(),
        serial: camera.device_serial_number()?.into(),
        address,
    })
}
