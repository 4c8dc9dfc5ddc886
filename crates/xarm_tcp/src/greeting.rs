//! Before anything else: who is there.

use devices::ARM_JOINTS;
use xarm_protocol::{Identity, Request};

use crate::config::XArmConfig;
use crate::control::{Control, ControlTask};
use crate::error::LinkError;

/// A controller that this driver can serve.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) control: Control,
    pub(crate) identity: Identity,
}

/// Connects to the control port, and refuses what is not the arm that is expected.
pub(crate) async fn greet(config: &XArmConfig) -> Result<(Link, ControlTask), LinkError> {
    let address = format!("{}:{}", config.host, config.control_port);
    let (control, task) = Control::connect(address.clone(), config.timeouts.connect).await?;
    let reply = control
        .ask("who are you", Request::Version, config.timeouts.reply)
        .await?;
    let mut identity = Identity::decode(&reply.data).map_err(|source| LinkError::Unsupported {
        address: address.clone(),
        source,
    })?;
    check_kind(&identity, &address)?;
    let reply = control
        .ask("your serial numbers", Request::SerialNumbers, config.timeouts.reply)
        .await?;
    if let Some(whole) = whole_serial(&identity.arm_serial, &reply.data) {
        identity.arm_serial = whole;
    }
    check_serial(&identity, config, address)?;
    let control = if identity.firmware.has_keep_alive() {
        control.keep_alive()
    } else {
        control
    };
    Ok((Link { control, identity }, task))
}

/// The identity has room for the first characters only; the whole number begins with them.
fn whole_serial(beginning: &str, data: &[u8]) -> Option<String> {
    let text = data.split(|byte| *byte == 0).next()?;
    let whole = std::str::from_utf8(text).ok()?.trim();
    whole.starts_with(beginning).then(|| whole.to_owned())
}

fn check_kind(identity: &Identity, address: &str) -> Result<(), LinkError> {
    let address = address.to_owned();
    if usize::from(identity.axes) != ARM_JOINTS {
        return Err(LinkError::OtherAxes {
            address,
            found: identity.axes,
        });
    }
    match identity.firmware.require_supported() {
        Ok(_) => Ok(()),
        Err(source) => Err(LinkError::Unsupported { address, source }),
    }
}

fn check_serial(identity: &Identity, config: &XArmConfig, address: String) -> Result<(), LinkError> {
    match &config.expected_serial {
        Some(expected) if *expected != identity.arm_serial => Err(LinkError::OtherArm {
            address,
            found: identity.arm_serial.clone(),
            expected: expected.clone(),
        }),
        _ => Ok(()),
    }
}
