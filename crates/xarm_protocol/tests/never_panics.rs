//! Whatever comes in, there is an answer or an error.

use proptest::prelude::*;
use xarm_protocol::{Feedback, Firmware, FrameReader, Identity, Reply, Report, ReportKind, ReportReader, Request};

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn frames(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let mut reader = FrameReader::default();
        reader.push(&bytes);
        while let Ok(Some(frame)) = reader.next() {
            let _ = Request::decode(frame.register(), frame.parameters());
            let _ = Reply::of_frame(&frame);
            let _ = Feedback::of_frame(&frame);
        }
    }

    #[test]
    fn requests_that_are_understood_are_written_as_they_came(
        register in 1_u8..=254,
        parameters in proptest::collection::vec(any::<u8>(), 0..50),
    ) {
        // What is dropped on purpose: detection and references, flags other than 0 and 1, numbers that are none.
        let Ok(request) = Request::decode(register, &parameters) else { return Ok(()) };
        let frame = request.frame(1, xarm_protocol::Protocol::Private);
        let again = Request::decode(frame.register(), frame.parameters());
        prop_assert_eq!(format!("{again:?}"), format!("{:?}", Ok::<_, ()>(request)));
    }

    #[test]
    fn reports(bytes in proptest::collection::vec(any::<u8>(), 0..700), kind in 0_usize..3) {
        let kind = [ReportKind::Real, ReportKind::Normal, ReportKind::Rich][kind];
        let _ = Report::decode(kind, &bytes);
        let mut reader = ReportReader::new(kind);
        reader.push(&bytes);
        while let Ok(Some(_)) = reader.next() {}
    }

    #[test]
    fn texts(text in ".{0,60}") {
        let _ = text.parse::<Firmware>();
        let _ = Identity::decode(text.as_bytes());
    }
}
