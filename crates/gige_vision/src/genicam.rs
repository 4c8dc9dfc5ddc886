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
            put(
                xml,
                format_args!("<Integer {head}{value}<Min>{least}</Min>{max}<Inc>{step}</Inc></Integer>\n"),
            );
            write_register(xml, feature, 4);
        }
        Kind::Float {
            per_unit,
            unit,
            least,
            most,
        } => {
            let (least, most) = (
                f64::from(least) / f64::from(per_unit),
                f64::from(most) / f64::from(per_unit),
            );
            put(
                xml,
                format_args!(
                    "<Float {head}<pValue>{name}Converter</pValue><Min>{least}</Min><Max>{most}</Max>\
                     <Unit>{unit}</Unit></Float>\n<Converter Name=\"{name}Converter\">\
                     <FormulaTo>FROM * {per_unit}</FormulaTo><FormulaFrom>TO / {per_unit}.0</FormulaFrom>{value}\
                     <Slope>Increasing</Slope></Converter>\n"
                ),
            );
            write_register(xml, feature, 4);
        }
        Kind::Enumeration(entries) => {
            put(xml, format_args!("<Enumeration {head}"));
            for (entry, code) in entries {
                put(
                    xml,
                    format_args!(
                        "<EnumEntry Name=\"{entry}\" NameSpace=\"Standard\"><Value>{code}</Value></EnumEntry>"
                    ),
                );
            }
            put(xml, format_args!("{value}</Enumeration>\n"));
            write_register(xml, feature, 4);
        }
        Kind::Command(code) => {
            put(
                xml,
                format_args!("<Command {head}{value}<CommandValue>{code}</CommandValue></Command>\n"),
            );
            write_register(xml, feature, 4);
        }
        Kind::Text(length) => put(
            xml,
            format_args!("<StringReg {head}{}</StringReg>\n", register_body(feature, length)),
        ),
        Kind::Wide => {
            put(xml, format_args!("<Integer {head}{value}</Integer>\n"));
            write_register(xml, feature, 8);
        }
        Kind::Bits {
            lowest,
            highest,
            least,
            most,
        } => {
            put(
                xml,
                format_args!("<Integer {head}{value}<Min>{least}</Min><Max>{most}</Max></Integer>\n"),
            );
            // Big-endian registers count their bits from the most significant.
            let bits = format!("<LSB>{}</LSB><MSB>{}</MSB>", 31 - lowest, 31 - highest);
            write_masked(xml, feature, &bits);
        }
        Kind::Flag(bit) => {
            put(
                xml,
                format_args!("<Boolean {head}{value}<OnValue>1</OnValue><OffValue>0</OffValue></Boolean>\n"),
            );
            write_masked(xml, feature, &format!("<Bit>{}</Bit>", 31 - bit));
        }
    }
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

fn write_register(xml: &mut String, feature: &Feature, length: u32) {
    let body = register_body(feature, length);
    put(
        xml,
        format_args!(
            "<IntReg Name=\"{}Register\">{body}<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
            feature.name
        ),
    );
}

fn write_masked(xml: &mut String, feature: &Feature, bits: &str) {
    let body = register_body(feature, 4);
    put(
        xml,
        format_args!(
            "<MaskedIntReg Name=\"{}Register\">{body}{bits}<Sign>Unsigned</Sign>\
             <Endianess>BigEndian</Endianess></MaskedIntReg>\n",
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
