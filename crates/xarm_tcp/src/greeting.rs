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
    let identity = Identity::decode(&reply.data).map_err(|source| LinkError::Unsupported {
        address: address.clone(),
        source,
    })?;
    check(&identity, config, address)?;
    let control = if identity.firmware.has_keep_alive() {
        control.keep_alive()
    } else {
        control
    };
    Ok((Link { control, identity }, task))
}

fn check(identity: &Identity, config: &XArmConfig, address: String) -> Result<(), LinkError> {
    if usize::from(identity.axes) != ARM_JOINTS {
        return Err(LinkError::OtherAxes {
            address,
            found: identity.axes,
        });
    }
    if let Err(source) = identity.firmware.require_supported() {
        return Err(LinkError::Unsupported { address, source });
    }
    match &config.expected_serial {
        Some(expected) if *expected != identity.arm_serial => Err(LinkError::OtherArm {
            address,
            found: identity.arm_serial.clone(),
            expected: expected.clone(),
        }),
        _ => Ok(()),
    }
}
