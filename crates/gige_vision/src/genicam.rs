//! The GenICam description, written from the table of features.

use std::fmt::Write;

use crate::features::{CATEGORIES, FEATURES, Feature, Kind};

/// Nodes that compute limits from other features.
const COMPUTED: [(&str, &str, &[&str]); 7] = [
    (
        "WidthMax",
        "SENSORWIDTH / BINNINGHORIZONTAL / 4 * 4",
        &["SensorWidth", "BinningHorizontal"],
    ),
    (
        "HeightMax",
        "SENSORHEIGHT / BINNINGVERTICAL",
        &["SensorHeight", "BinningVertical"],
    ),
    ("WidthLimit", "WIDTHMAX - OFFSETX", &["WidthMax", "OffsetX"]),
    ("HeightLimit", "HEIGHTMAX - OFFSETY", &["HeightMax", "OffsetY"]),
    ("OffsetXLimit", "WIDTHMAX - WIDTH", &["WidthMax", "Width"]),
    ("OffsetYLimit", "HEIGHTMAX - HEIGHT", &["HeightMax", "Height"]),
    (
        "PayloadSize",
        "WIDTH * HEIGHT * ((PIXELFORMAT >> 16) &amp; 0xFF) / 8",
        &["Width", "Height", "PixelFormatRegister"],
    ),
];

/// Computed nodes that users see, beside the table's.
const SHOWN: [(&str, &str); 3] = [
    ("WidthMax", "ImageFormatControl"),
    ("HeightMax", "ImageFormatControl"),
    ("PayloadSize", "TransportLayerControl"),
];

/// The whole description.
pub(crate) fn describe(vendor: &str, model: &str) -> String {
    let (vendor, model) = (identifier(vendor), identifier(model));
    let mut xml = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<RegisterDescription ModelName="{model}" VendorName="{vendor}" StandardNameSpace="None" SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0" SubMinorVersion="0" ProductGuid="6A1D6A52-17D2-4D1C-8B0B-52414B454C49" VersionGuid="6A1D6A52-17D2-4D1C-8B0B-52414B454C4A" xmlns="http://www.genicam.org/GenApi/Version_1_1" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.genicam.org/GenApi/Version_1_1 GenApiSchema_Version_1_1.xsd">
"#
    );
    write_categories(&mut xml);
    for feature in FEATURES {
        write_feature(&mut xml, feature);
    }
    for (name, formula, variables) in COMPUTED {
        write_computed(&mut xml, name, formula, variables);
    }
    xml += "<Port Name=\"Device\"/>\n</RegisterDescription>\n";
    xml
}

/// GenICam allows only letters, digits and underscores in these two.
fn identifier(name: &str) -> String {
    name.chars()
        .map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' })
        .collect()
}

/// `String` never fails to take text.
fn put(xml: &mut String, text: std::fmt::Arguments<'_>) {
    let _ = xml.write_fmt(text);
}

fn write_categories(xml: &mut String) {
    xml.push_str("<Category Name=\"Root\">");
    for category in CATEGORIES {
        put(xml, format_args!("<pFeature>{category}</pFeature>"));
    }
    xml.push_str("</Category>\n");
    for category in CATEGORIES {
        put(xml, format_args!("<Category Name=\"{category}\">"));
        let listed = FEATURES
            .iter()
            .map(|feature| (feature.name, feature.category))
            .chain(SHOWN);
        for (name, _) in listed.filter(|(_, of)| *of == category) {
            put(xml, format_args!("<pFeature>{name}</pFeature>"));
        }
        xml.push_str("</Category>\n");
    }
}

fn write_computed(xml: &mut String, name: &str, formula: &str, variables: &[&str]) {
    put(xml, format_args!("<IntSwissKnife Name=\"{name}\">"));
    for variable in variables {
        let symbol = variable.trim_end_matches("Register").to_uppercase();
        put(xml, format_args!("<pVariable Name=\"{symbol}\">{variable}</pVariable>"));
    }
    put(xml, format_args!("<Formula>{formula}</Formula></IntSwissKnife>\n"));
}

/// What users see of a feature, and the register behind it.
fn write_feature(xml: &mut String, feature: &Feature) {
    let Feature { name, tooltip, .. } = feature;
    let head = format!("Name=\"{name}\" NameSpace=\"Standard\"><ToolTip>{tooltip}</ToolTip>");
    let value = format!("<pValue>{name}Register</pValue>");
    match feature.kind {
        Kind::Integer {
            least,
            most,
            step,
            limit,
        } => {
            let max = limit.map_or(format!("<Max>{most}</Max>"), |node| format!("<pMax>{node}</pMax>"));
            let range = format!("<Min>{least}</Min>{max}<Inc>{step}</Inc>");
            put(xml, format_args!("<Integer {head}{value}{range}</Integer>\n"));
        }
        Kind::Float { .. } => write_float(xml, feature, &head),
        Kind::Enumeration(entries) => {
            let entries: String = entries.iter().map(enum_entry).collect();
            put(xml, format_args!("<Enumeration {head}{entries}{value}</Enumeration>\n"));
        }
        Kind::Command(code) => {
            let code = format!("<CommandValue>{code}</CommandValue>");
            put(xml, format_args!("<Command {head}{value}{code}</Command>\n"));
        }
        // Text is its own register.
        Kind::Text(length) => {
            let body = register_body(feature, length);
            put(xml, format_args!("<StringReg {head}{body}</StringReg>\n"));
        }
        Kind::Wide => put(xml, format_args!("<Integer {head}{value}</Integer>\n")),
        Kind::Bits { least, most, .. } => {
            let range = format!("<Min>{least}</Min><Max>{most}</Max>");
            put(xml, format_args!("<Integer {head}{value}{range}</Integer>\n"));
        }
        Kind::Flag(_) => {
            let values = "<OnValue>1</OnValue><OffValue>0</OffValue>";
            put(xml, format_args!("<Boolean {head}{value}{values}</Boolean>\n"));
        }
    }
    write_register(xml, feature);
}

fn enum_entry((name, code): &(&str, u32)) -> String {
    format!("<EnumEntry Name=\"{name}\" NameSpace=\"Standard\"><Value>{code}</Value></EnumEntry>")
}

fn write_float(xml: &mut String, feature: &Feature, head: &str) {
    let Kind::Float {
        per_unit,
        unit,
        least,
        most,
    } = feature.kind
    else {
        return;
    };
    let name = feature.name;
    let in_units = |count: u32| f64::from(count) / f64::from(per_unit);
    let (least, most) = (in_units(least), in_units(most));
    put(
        xml,
        format_args!(
            "<Float {head}<pValue>{name}Converter</pValue><Min>{least}</Min><Max>{most}</Max><Unit>{unit}</Unit>\
             </Float>\n<Converter Name=\"{name}Converter\"><FormulaTo>FROM * {per_unit}</FormulaTo>\
             <FormulaFrom>TO / {per_unit}.0</FormulaFrom><pValue>{name}Register</pValue>\
             <Slope>Increasing</Slope></Converter>\n"
        ),
    );
}

fn register_body(feature: &Feature, length: u32) -> String {
    let access = match (feature.kind, feature.writable) {
        (Kind::Command(_), _) => "WO",
        (_, true) => "RW",
        (_, false) => "RO",
    };
    format!(
        "<Address>{:#x}</Address><Length>{length}</Length><AccessMode>{access}</AccessMode><pPort>Device</pPort>\
         <Cachable>NoCache</Cachable>",
        feature.address
    )
}

/// Big-endian registers count their bits from the most significant.
fn write_register(xml: &mut String, feature: &Feature) {
    let (element, length, bits) = match feature.kind {
        Kind::Text(_) => return,
        Kind::Bits { lowest, highest, .. } => {
            let bits = format!("<LSB>{}</LSB><MSB>{}</MSB>", 31 - lowest, 31 - highest);
            ("MaskedIntReg", 4, bits)
        }
        Kind::Flag(bit) => ("MaskedIntReg", 4, format!("<Bit>{}</Bit>", 31 - bit)),
        Kind::Wide => ("IntReg", 8, String::new()),
        _ => ("IntReg", 4, String::new()),
    };
    let body = register_body(feature, length);
    put(
        xml,
        format_args!(
            "<{element} Name=\"{}Register\">{body}{bits}<Sign>Unsigned</Sign>\
             <Endianess>BigEndian</Endianess></{element}>\n",
            feature.name
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names that some element refers to with `<p...>`.
    fn references(xml: &str) -> Vec<&str> {
        ["pFeature", "pValue", "pMax", "pPort"]
            .iter()
            .flat_map(|tag| xml.split(&format!("<{tag}>")).skip(1).collect::<Vec<_>>())
            .chain(
                xml.split("<pVariable ")
                    .skip(1)
                    .filter_map(|rest| rest.split_once('>').map(|(_, rest)| rest)),
            )
            .filter_map(|rest| rest.split('<').next())
            .collect()
    }

    #[test]
    fn every_reference_has_its_node() {
        let xml = describe("Rakelight", "Simulated camera");
        let names = references(&xml);
        assert!(names.len() > FEATURES.len());
        for name in names {
            assert!(xml.contains(&format!("Name=\"{name}\"")), "{name}");
        }
    }

    #[test]
    fn names_become_identifiers() {
        assert!(describe("A & B", "c<d").contains("ModelName=\"c_d\" VendorName=\"A___B\""));
    }
}
