//! What a controller says of itself.

use std::str::FromStr;

use crate::error::ProtocolError;
use crate::firmware::Firmware;

/// Bytes that the text is padded to.
const PADDED: usize = 40;

/// The answer to the first request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Joints.
    pub axes: u8,
    /// The vendor's number of the arm's type; 7 is the present xArm7.
    pub robot_type: u8,
    /// Of the arm, such as XI130506A1B2C3.
    pub arm_serial: String,
    /// Of the control box.
    pub box_serial: String,
    /// Of the control box.
    pub firmware: Firmware,
}

/// Arms of different make have different limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Generation {
    /// Serial numbers below 1305.
    Before1305,
    /// 1305 and later.
    From1305,
}

/// What a joint of the xArm7 can reach, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Smallest angle.
    pub lower: f64,
    /// Largest angle.
    pub upper: f64,
}

impl Generation {
    /// By the digits at places 2 to 5 of the arm's serial number; what has none is taken for the newer make, whose
    /// limits are narrower.
    pub fn of_serial(arm_serial: &str) -> Self {
        match arm_serial.get(2..6).and_then(|digits| digits.parse::<u16>().ok()) {
            Some(number) if number < 1305 => Self::Before1305,
            _ => Self::From1305,
        }
    }

    /// Of the joints of an xArm7.
    pub fn joint_ranges(self) -> [JointRange; 7] {
        let turn = std::f64::consts::TAU;
        let range = |lower, upper| JointRange { lower, upper };
        let (second, fourth) = match self {
            Self::Before1305 => (range(-2.059_488, 2.094_395), range(-0.191_986, 3.926_99)),
            Self::From1305 => (range(-2.042_035, 2.024_581), range(-0.104_72, 3.926_99)),
        };
        let free = range(-turn, turn);
        let sixth = range(-1.692_969, std::f64::consts::PI);
        [free, second, free, fourth, free, sixth, free]
    }
}

impl Identity {
    /// ASCII, padded with zeros.
    pub fn encode(&self) -> Vec<u8> {
        let Self {
            axes,
            robot_type,
            arm_serial,
            box_serial,
            firmware,
        } = self;
        let mut bytes = format!("{axes},{robot_type},{arm_serial},{box_serial},{firmware}").into_bytes();
        bytes.resize(bytes.len().max(PADDED), 0);
        bytes
    }

    /// From the reply's data.
    pub fn decode(data: &[u8]) -> Result<Self, ProtocolError> {
        let end = data.iter().position(|byte| *byte == 0).unwrap_or(data.len());
        String::from_utf8_lossy(&data[..end]).parse()
    }

    /// Of the arm.
    pub fn generation(&self) -> Generation {
        Generation::of_serial(&self.arm_serial)
    }
}

impl FromStr for Identity {
    type Err = ProtocolError;

    /// "7,7,XI130506A1B2C3,AC130501D4E5F6,v2.5.5"
    fn from_str(text: &str) -> Result<Self, ProtocolError> {
        let wrong = || ProtocolError::Identity {
            found: text.chars().take(80).collect(),
        };
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        let [axes, robot_type, arm_serial, box_serial, version] = fields[..] else {
            return Err(wrong());
        };
        Ok(Self {
            axes: axes.parse().map_err(|_| wrong())?,
            robot_type: robot_type.parse().map_err(|_| wrong())?,
            arm_serial: arm_serial.to_owned(),
            box_serial: box_serial.to_owned(),
            firmware: version.parse()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identity_is_read_as_it_is_written() {
        let identity: Identity = "7,7,XI130506A1B2C3,AC130501D4E5F6,v2.5.5".parse().expect("an identity");
        assert_eq!(Identity::decode(&identity.encode()).as_ref(), Ok(&identity));
        assert_eq!(identity.generation(), Generation::From1305);
        assert_eq!(Generation::of_serial("XI120106"), Generation::Before1305);
        assert!(Identity::decode(b"\0\0").is_err());
    }
}
