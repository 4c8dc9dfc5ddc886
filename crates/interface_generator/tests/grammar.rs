//! What the parser understands, and how it refuses the rest.

use interface_generator::{
    Count, Element, Error, Interface, Kind, Message, Primitive, TypeName, Value, parse_interface,
};
use proptest::prelude::*;

fn parse(text: &str) -> Result<Interface, Error> {
    parse_interface("Probe.msg", "demo_msgs", Kind::Msg, "Probe", text)
}

fn message(text: &str) -> Message {
    parse(text).unwrap().parts.remove(0)
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn types_and_counts() {
    let text = "byte a\nuint8[] b\nstring<=7[<=3] c\nstring[2] d\nPoint e\ngeometry_msgs/Point[<=4] f\nx_y1/msg/Z9[] g";
    let fields = message(text).fields;
    let named = |package: &str, name: &str| {
        Element::Message(TypeName {
            package: package.into(),
            kind: Kind::Msg,
            name: name.into(),
        })
    };
    let expected = [
        ("a", Element::Primitive(Primitive::Byte), Count::One),
        ("b", Element::Primitive(Primitive::Uint8), Count::Unbounded),
        ("c", Element::Text { bound: Some(7) }, Count::Bounded(3)),
        ("d", Element::Text { bound: None }, Count::Fixed(2)),
        ("e", named("demo_msgs", "Point"), Count::One),
        ("f", named("geometry_msgs", "Point"), Count::Bounded(4)),
        ("g", named("x_y1", "Z9"), Count::Unbounded),
    ];
    for (field, (name, element, count)) in fields.iter().zip(&expected) {
        assert_eq!(
            (field.name.as_str(), &field.element, &field.count),
            (*name, element, count)
        );
    }
    assert_eq!(fields.len(), expected.len());
    assert_eq!(fields[2].declaration, "string<=7[<=3] c");
    assert_eq!(fields[5].line, 6);
}

#[test]
fn spaces_and_tabs_do_not_matter() {
    let tidy = message("int32 a 1\nint32 B=2\n");
    let untidy = message("  int32 \t a\t1  \n\tint32   B \t=  2 \r\n");
    assert_eq!(
        (tidy.fields[0].default.as_ref(), &tidy.constants[0].value),
        (Some(&Value::Integer(1)), &Value::Integer(2))
    );
    assert_eq!(tidy.fields[0].default, untidy.fields[0].default);
    assert_eq!(tidy.constants[0].value, untidy.constants[0].value);
}

#[test]
fn values() {
    let value = |text: &str| message(text).fields[0].default.clone().unwrap();
    let text = |text: &str| Value::Text(text.to_owned());
    assert_eq!(value("bool a True"), Value::Bool(true));
    assert_eq!(value("int64 a -9223372036854775808"), Value::Integer(i64::MIN.into()));
    assert_eq!(value("float32 a 1e3"), Value::Float(1000.0));
    assert_eq!(value("string a bare words # comment"), text("bare words"));
    assert_eq!(value(r#"string a "a # b" # comment"#), text("a # b"));
    assert_eq!(value(r"string a 'it\'s \n \\'"), text(r"it's \n \"));
    assert_eq!(value("string a ''"), text(""));
    assert_eq!(value("int8[] a []"), Value::List(vec![]));
    assert_eq!(
        value("int8[2] a [1,-2]"),
        Value::List(vec![Value::Integer(1), Value::Integer(-2)])
    );
    let words = vec![text("a, b"), text("#c"), text("d e")];
    assert_eq!(
        value(r#"string[] a ["a, b", '#c', d e]  # comment"#),
        Value::List(words)
    );
    assert_eq!(message("string A='= # ='").constants[0].value, text("= # ="));
    assert_eq!(message("string A=it's # five").constants[0].value, text("it's"));
}

#[test]
fn comments_find_their_owner() {
    let text = include_str!("packages/grammar_msgs/msg/Comments.msg");
    let message = message(text);
    assert_eq!(message.comments, ["The message's own comment."]);
    let comments: Vec<_> = message.fields.iter().map(|field| field.comments.join(" | ")).collect();
    assert_eq!(
        comments,
        [
            "Above the first field.",
            "behind | and indented below",
            "Box comments lose their extra signs. ## | without a space"
        ]
    );
    assert_eq!(message.constants[0].comments, ["three"]);
    assert_eq!(message.text, text);
}

#[test]
fn sections_of_services_and_actions() {
    let action = "int32 a\n---\nint32 b\n---  \nint32 c";
    let parsed = parse_interface("Go.action", "demo_msgs", Kind::Action, "Go", action).unwrap();
    let names: Vec<_> = parsed.parts.iter().map(|part| part.name.to_string()).collect();
    assert_eq!(
        names,
        [
            "demo_msgs/action/Go_Goal",
            "demo_msgs/action/Go_Result",
            "demo_msgs/action/Go_Feedback"
        ]
    );
    assert_eq!(parsed.parts[2].fields[0].line, 5);
    let empty = parse_interface("Go.srv", "demo_msgs", Kind::Srv, "Go", "---").unwrap();
    assert!(empty.parts.iter().all(|part| part.fields.is_empty()));
    let refused = parse_interface("Go.srv", "demo_msgs", Kind::Srv, "Go", "int32 a\n").unwrap_err();
    assert_eq!(
        refused.to_string(),
        "Go.srv:1: 1 sections; allowed: 2, separated by lines of `---`"
    );
    let refused = parse_interface("Go.srv", "demo_msgs", Kind::Srv, "Go", "---\n\nint32 A\n").unwrap_err();
    assert!(
        refused
            .to_string()
            .starts_with("Go.srv:3: field name `A`; allowed: lower-case"),
        "{refused}"
    );
}

#[test]
fn refusals_name_place_finding_and_what_is_allowed() {
    for (text, expected) in [
        ("\nint32", "2: `int32` has no name; allowed: `TYPE NAME`"),
        ("int32 # name", "1: `int32 # name` has no name"),
        ("int33 a", "1: type `int33`; allowed: bool, byte"),
        ("int32[2][2] a", "1: type `int32[2][2]`; allowed"),
        ("int32] a", "1: type `int32]`; allowed"),
        ("int32<=3 a", "1: type `int32<=3`; allowed"),
        ("a/b/c/D a", "1: type `a/b/c/D`; allowed"),
        ("a/srv/D a", "1: type `a/srv/D`; allowed"),
        (
            "int32[0] a",
            "1: bound or length `0`; allowed: a whole number from 1 to 4294967295",
        ),
        ("int32[<=x] a", "1: bound or length `x`"),
        ("string<=-1 a", "1: bound or length `-1`"),
        ("string<=5000000000 a", "1: bound or length `5000000000`"),
        ("wstring a", "1: `wstring`: wide strings are not supported, because"),
        ("wstring<=3[] a", "1: `wstring<=3[]`: wide strings"),
        (
            "time a",
            "1: `time` is a ROS 1 type; allowed: `builtin_interfaces/Time`",
        ),
        (
            "duration[] a",
            "1: `duration[]` is a ROS 1 type; allowed: `builtin_interfaces/Duration`",
        ),
        ("int32 A", "1: field name `A`; allowed: lower-case letters"),
        ("int32 a__b", "1: field name `a__b`"),
        ("int32 a_", "1: field name `a_`"),
        ("int32 _a", "1: field name `_a`"),
        ("int32 1a", "1: field name `1a`"),
        ("int32 a=1", "1: constant name `a`; allowed: upper-case letters"),
        (
            "int32[] A=[1]",
            "1: a constant of type `int32[]`; allowed: one value of a builtin type",
        ),
        ("Point A=1", "1: a constant of type `Point`"),
        (
            "Point a 1",
            "1: default `1` for a message; allowed: defaults for builtin types",
        ),
        ("uint8 a 256", "1: value `256`; allowed: a whole number from 0 to 255"),
        ("uint8 a 0x10", "1: value `0x10`; allowed: a whole number"),
        (
            "int64 A=9223372036854775808",
            "1: value `9223372036854775808`; allowed: a whole number from -9223372036854775808",
        ),
        ("float32 a 1e39", "1: value `1e39`; allowed: a number from"),
        ("float64 a one", "1: value `one`; allowed: a number such as"),
        ("bool a maybe", "1: value `maybe`; allowed: true, false, 1 or 0"),
        (
            "string A=\"open",
            "1: value `\"open`; allowed: text that ends with the \" it began with",
        ),
        ("string<=2 a abc", "1: default of length 3; allowed: at most 2 bytes"),
        ("int32[2] a [1]", "1: default of length 1; allowed: exactly 2"),
        ("int32[<=1] a [1, 2]", "1: default of length 2; allowed: at most 1"),
        ("int32[] a 1", "1: value `1`; allowed: a list such as [1, 2] or []"),
        (
            "int32[] a [1,,2]",
            "1: value `[1,,2]`; allowed: one value between commas",
        ),
        (
            "int32 a\nint32 b\nbool a",
            "3: the name `a` was used in line 1; allowed: each name once",
        ),
        ("int32 a\n---\n", "1: 2 sections; allowed: 1"),
    ] {
        let refused = refusal(text);
        assert!(
            refused.starts_with(&format!("Probe.msg:{expected}")),
            "{text:?}: {refused}"
        );
    }
    let refused = parse_interface("x", "demo_msgs", Kind::Msg, "my_msg", "")
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("x:1: interface name `my_msg`; allowed: letters and digits"),
        "{refused}"
    );
}

/// Lines out of the grammar's own pieces, right and wrong.
fn line() -> impl Strategy<Value = String> {
    let piece = prop::sample::select(vec![
        "int32",
        "string",
        "wstring",
        "string<=3",
        "uint8[]",
        "Point",
        "a/B",
        "[",
        "]",
        "[<=2]",
        "[1, 2]",
        " ",
        " ",
        "=",
        "#",
        "'",
        "\"",
        "\\",
        ",",
        "name",
        "NAME",
        "-1",
        "99999999999999999999",
        "1e999",
        "nan",
        "é",
        "---",
        "\t",
        "true",
    ]);
    prop::collection::vec(piece, 0..8).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_text_is_parsed_or_refused(text in "\\PC*(\n\\PC*){0,4}") {
        for kind in Kind::ALL {
            let _ = parse_interface("any", "demo_msgs", kind, "Any", &text);
        }
    }

    #[test]
    fn lines_of_known_pieces_are_parsed_or_refused(lines in prop::collection::vec(line(), 0..6)) {
        for kind in Kind::ALL {
            let _ = parse_interface("any", "demo_msgs", kind, "Any", &lines.join("\n"));
        }
    }

    #[test]
    fn a_declared_field_is_found(name in "[a-z][a-z0-9]{0,8}", length in 1_u32.., value in any::<i64>()) {
        let message = message(&format!("int64 {name} {value}\nint64[{length}] {name}_array"));
        prop_assert_eq!(message.fields[0].default.as_ref(), Some(&Value::Integer(value.into())));
        prop_assert_eq!(message.fields[1].count, Count::Fixed(length as usize));
    }

    #[test]
    fn quoted_text_comes_back(text in "[^\r\n]*") {
        let quoted = text.replace('\\', "\\\\").replace('"', "\\\"");
        let constants = message(&format!("string A=\"{quoted}\" # comment")).constants;
        prop_assert_eq!(&constants[0].value, &Value::Text(text));
    }
}
