//! Folders of interface files: what is read, what is refused, and what is written.

use std::fs;
use std::path::Path;

use interface_generator::{Error, Kind, Packages, concatenated_definition, parse_interface, write_rust};
use tempfile::TempDir;

/// Packages out of `("package/msg/Name.msg", text)` pairs.
fn packages(files: &[(&str, &str)]) -> Result<Packages, Error> {
    let folder = TempDir::new().unwrap();
    for (path, text) in files {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let mut names: Vec<&str> = files.iter().map(|(path, _)| path.split('/').next().unwrap()).collect();
    names.dedup();
    let mut packages = Packages::new();
    for name in names {
        packages.add_folder(name, &folder.path().join(name))?;
    }
    packages.resolve()?;
    Ok(packages)
}

fn refusal(files: &[(&str, &str)]) -> String {
    packages(files).unwrap_err().to_string()
}

#[test]
fn header_is_the_standard_one_unless_the_package_has_its_own() {
    let standard = ("std_msgs/msg/Header.msg", "string frame_id\n");
    let rust = |files: &[(&str, &str)]| write_rust(&packages(files).unwrap(), &["demo_msgs"], "::interfaces").unwrap();
    let with_standard = rust(&[("demo_msgs/msg/A.msg", "Header header"), standard]);
    assert!(
        with_standard.contains("pub header: ::interfaces::std_msgs::msg::Header,"),
        "{with_standard}"
    );
    let own = ("demo_msgs/msg/Header.msg", "int32 number");
    let with_own = rust(&[("demo_msgs/msg/A.msg", "Header header"), own, standard]);
    assert!(
        with_own.contains("pub header: super::super::demo_msgs::msg::Header,"),
        "{with_own}"
    );
}

#[test]
fn missing_types_are_named_with_their_place() {
    let refused = refusal(&[("demo_msgs/srv/A.srv", "int32 x\n---\n\nother_msgs/B[] b\n")]);
    assert!(
        refused.ends_with("A.srv:4: `other_msgs/msg/B` is defined in none of the packages [\"demo_msgs\"]"),
        "{refused}"
    );
}

#[test]
fn messages_that_contain_themselves_are_refused() {
    let refused = refusal(&[
        ("demo_msgs/msg/A.msg", "B[] b"),
        ("demo_msgs/msg/B.msg", "int32 x\nA a"),
    ]);
    assert!(
        refused.contains("demo_msgs/msg/A -> demo_msgs/msg/B -> demo_msgs/msg/A"),
        "{refused}"
    );
}

#[test]
fn clashing_rust_names_are_refused() {
    let refused = refusal(&[("demo_msgs/srv/A.srv", "---"), ("demo_msgs/srv/ARequest.srv", "---")]);
    assert!(
        refused.contains("`demo_msgs/srv/A_Request` and `demo_msgs/srv/ARequest`"),
        "{refused}"
    );
    assert!(
        refused.ends_with("would both become the Rust type `ARequest`"),
        "{refused}"
    );
}

#[test]
fn unreadable_files_and_wrong_packages_are_refused() {
    let refused = refusal(&[("demo_msgs/msg/A.idl", "module x {}")]);
    assert!(
        refused.contains("A.idl: .idl files are not read; allowed: .msg in msg/"),
        "{refused}"
    );
    let refused = refusal(&[("Demo/msg/A.msg", "")]);
    assert!(
        refused.starts_with("`Demo` is not a package name; allowed: lower-case letters"),
        "{refused}"
    );
    let mut twice = packages(&[("demo_msgs/msg/A.msg", "")]).unwrap();
    let refused = twice.add_interfaces("demo_msgs", Vec::new()).unwrap_err().to_string();
    assert_eq!(
        refused,
        "package demo_msgs was added before; each package comes from one folder"
    );
    let refused = write_rust(&twice, &["other_msgs"], "crate").unwrap_err().to_string();
    assert_eq!(refused, "package other_msgs was never added; added are [\"demo_msgs\"]");

    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("msg")).unwrap();
    fs::write(folder.path().join("msg/A.msg"), b"int32 a # \xff\xfe").unwrap();
    let refused = Packages::new()
        .add_folder("demo_msgs", folder.path())
        .unwrap_err()
        .to_string();
    assert!(
        refused.starts_with("cannot read ") && refused.contains("A.msg: "),
        "{refused}"
    );
}

#[test]
fn sources_are_all_files_and_folders() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/packages/grammar_msgs");
    let mut packages = Packages::new();
    packages.add_folder("grammar_msgs", &folder).unwrap();
    for watched in [
        "",
        "msg",
        "srv",
        "action",
        "msg/Scalars.msg",
        "srv/Ask.srv",
        "action/Walk.action",
    ] {
        let watched = if watched.is_empty() {
            folder.clone()
        } else {
            folder.join(watched)
        };
        assert!(
            packages.sources().contains(&watched),
            "{} is not watched",
            watched.display()
        );
    }
}

#[test]
fn definitions_hold_nested_types_once() {
    let packages = packages(&[
        ("demo_msgs/msg/A.msg", "# of A\nB b\nB[] more\nother_msgs/C c\n"),
        ("demo_msgs/msg/B.msg", "other_msgs/C c"),
        ("other_msgs/msg/C.msg", "int32 x  # of C\n"),
    ])
    .unwrap();
    let line = "=".repeat(80);
    assert_eq!(
        concatenated_definition(&packages, &packages.interfaces("demo_msgs").unwrap()[0].parts[0]),
        format!(
            "# of A\nB b\nB[] more\nother_msgs/C c\n\
             {line}\nMSG: demo_msgs/B\nother_msgs/C c\n\
             {line}\nMSG: other_msgs/C\nint32 x  # of C\n"
        )
    );
}

#[test]
fn a_message_becomes_a_documented_struct() {
    let text = "# A reading.\n\nuint8 WARN=1  # be careful\nstring<=16 name 'none'  # who said it\nfloat64[2] range\n";
    let report = parse_interface("Report.msg", "demo_msgs", Kind::Msg, "Report", text).unwrap();
    let mut packages = Packages::new();
    packages.add_interfaces("demo_msgs", vec![report]).unwrap();
    packages.resolve().unwrap();
    let rust = write_rust(&packages, &["demo_msgs"], "::interfaces").unwrap();
    for expected in [
        "#[doc = \" A reading.\"]",
        "pub struct Report {",
        "#[doc = \" who said it\"]",
        "pub name: ::std::string::String,",
        "pub range: [f64; 2],",
        "pub const WARN: u8 = 1;",
        "name: ::std::string::String::from(\"none\"),",
        "range: ::core::array::from_fn(|_| ::core::default::Default::default()),",
        "const TEXT: ::core::option::Option<usize> = ::core::option::Option::Some(16);",
        "const TYPE_NAME: &'static str = \"demo_msgs/msg/Report\";",
        "visitor.visit::<demo_msgs::msg::Report>();",
    ] {
        assert!(rust.contains(expected), "{expected} is missing in\n{rust}");
    }
    assert_eq!(rust.matches('{').count(), rust.matches('}').count());
}
