//! Between message types and the bytes that DDS carries: CDR adapters, topic and type names on the wire.

use std::marker::PhantomData;
use std::sync::Arc;

use interfaces::Message;
use interfaces::cdr::Endianness;
use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};

/// Serialises an `Arc<M>` in place: a published message is never cloned.
pub(crate) struct Cdr<M>(PhantomData<M>);

impl<M: Message> SerializerAdapter<Arc<M>> for Cdr<M> {
    type Error = interfaces::cdr::Error;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(message: &Arc<M>) -> Result<Bytes, Self::Error> {
        interfaces::cdr::to_body(message.as_ref()).map(Bytes::from)
    }
}

impl<M: Message> DeserializerAdapter<Arc<M>> for Cdr<M> {
    type Error = interfaces::cdr::Error;
    type Decoded = Arc<M>;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Arc<M>) -> Arc<M> {
        decoded
    }
}

impl<M: Message> DefaultDecoder<Arc<M>> for Cdr<M> {
    type Decoder = CdrDecoder<M>;
    const DECODER: CdrDecoder<M> = CdrDecoder(PhantomData);
}

pub(crate) struct CdrDecoder<M>(PhantomData<M>);

// Derived, it would ask for `M: Clone`.
impl<M> Clone for CdrDecoder<M> {
    fn clone(&self) -> Self {
        Self(PhantomData)
    }
}

impl<M: Message> Decode<'_, Arc<M>> for CdrDecoder<M> {
    type Error = interfaces::cdr::Error;

    fn decode_bytes(self, body: &[u8], encoding: RepresentationIdentifier) -> Result<Arc<M>, Self::Error> {
        let big_endian = encoding == RepresentationIdentifier::CDR_BE;
        let endianness = if big_endian {
            Endianness::Big
        } else {
            Endianness::Little
        };
        interfaces::cdr::from_body(body, endianness).map(Arc::new)
    }
}

/// A DDS topic: its name and the name of its type, both as ROS 2 writes them on the wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WireTopic {
    pub(crate) name: String,
    pub(crate) type_name: String,
}

impl WireTopic {
    /// `/cell/c1/normals` of `sensor_msgs/msg/Image` is `rt/cell/c1/normals` of `sensor_msgs::msg::dds_::Image_`.
    pub(crate) fn message(topic: &str, type_name: &str) -> Self {
        Self {
            name: format!("rt{topic}"),
            type_name: dds_type(type_name, ""),
        }
    }

    /// The request half of a service.
    pub(crate) fn request(service: &str, type_name: &str) -> Self {
        Self {
            name: format!("rq{service}Request"),
            type_name: dds_type(type_name, "_Request"),
        }
    }

    /// The response half of a service.
    pub(crate) fn response(service: &str, type_name: &str) -> Self {
        Self {
            name: format!("rr{service}Reply"),
            type_name: dds_type(type_name, "_Response"),
        }
    }
}

/// `package/kind/Name` is `package::kind::dds_::Name_` on the wire.
fn dds_type(type_name: &str, suffix: &str) -> String {
    let (scope, name) = type_name.rsplit_once('/').unwrap_or(("", type_name));
    format!("{}::dds_::{name}{suffix}_", scope.replace('/', "::"))
}

/// The ROS topic and type behind names on the wire; `None` for what is no topic, such as half a service.
pub(crate) fn ros_topic(wire_name: &str, dds_type: &str) -> Option<(String, String)> {
    let topic = wire_name.strip_prefix("rt").filter(|topic| topic.starts_with('/'))?;
    let (scope, name) = dds_type.strip_suffix('_')?.split_once("::dds_::")?;
    Some((topic.to_owned(), format!("{}/{name}", scope.replace("::", "/"))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_the_wire_are_those_of_ros_2() {
        let topic = WireTopic::message("/cell/c1/normals", "sensor_msgs/msg/Image");
        assert_eq!(
            (topic.name.as_str(), topic.type_name.as_str()),
            ("rt/cell/c1/normals", "sensor_msgs::msg::dds_::Image_")
        );
        let back = ros_topic(&topic.name, &topic.type_name);
        assert_eq!(back, Some(("/cell/c1/normals".into(), "sensor_msgs/msg/Image".into())));
        let request = WireTopic::request("/cell/pick", "std_srvs/srv/Trigger");
        assert_eq!(ros_topic(&request.name, &request.type_name), None);
        assert_eq!(request.name, "rq/cell/pickRequest");
        assert_eq!(request.type_name, "std_srvs::srv::dds_::Trigger_Request_");
        assert_eq!(
            WireTopic::response("/cell/pick", "std_srvs/srv/Trigger").name,
            "rr/cell/pickReply"
        );
    }
}
