//! VTU in all its encodings.

use crate::body::{body, read, refusal, tag, volume};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use palpate_mesh::{Mesh, MeshFile};
use std::io::Write;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    Text,
    Base64,
    Raw,
    AppendedBase64,
}

#[derive(Clone, Copy, Debug)]
pub struct Encoding {
    pub format: Format,
    pub is_compressed: bool,
    pub is_big_endian: bool,
    pub has_long_sizes: bool,
}

/// Arrays of a file, and the appended data.
struct Writer {
    encoding: Encoding,
    appended: Vec<u8>,
}

impl Writer {
    fn size(&self, number: u64) -> Vec<u8> {
        match (self.encoding.has_long_sizes, self.encoding.is_big_endian) {
            (true, true) => number.to_be_bytes().to_vec(),
            (true, false) => number.to_le_bytes().to_vec(),
            (false, true) => (number as u32).to_be_bytes().to_vec(),
            (false, false) => (number as u32).to_le_bytes().to_vec(),
        }
    }

    /// Sizes and data: of compressed data two parts that base64 keeps apart.
    fn packed(&self, data: &[u8]) -> Vec<Vec<u8>> {
        const BLOCK: usize = 100;
        if !self.encoding.is_compressed {
            return vec![[self.size(data.len() as u64), data.to_vec()].concat()];
        }
        let blocks: Vec<Vec<u8>> = data
            .chunks(BLOCK)
            .map(|block| {
                let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                encoder.write_all(block).expect("memory");
                encoder.finish().expect("memory")
            })
            .collect();
        let sizes = [blocks.len(), BLOCK, data.len() % BLOCK].into_iter().chain(blocks.iter().map(Vec::len));
        vec![sizes.flat_map(|size| self.size(size as u64)).collect(), blocks.concat()]
    }

    fn array(&mut self, attributes: &str, numbers: &[(String, Vec<u8>)]) -> String {
        let data: Vec<u8> = numbers
            .iter()
            .flat_map(|(_, bytes)| {
                let mut bytes = bytes.clone();
                if self.encoding.is_big_endian {
                    bytes.reverse();
                }
                bytes
            })
            .collect();
        let base64 =
            |parts: Vec<Vec<u8>>| parts.iter().map(|part| BASE64_STANDARD.encode(part)).collect::<String>();
        match self.encoding.format {
            Format::Text => {
                let words: Vec<_> = numbers.iter().map(|(text, _)| text.as_str()).collect();
                format!("<DataArray {attributes} format=\"ascii\">\n{}\n</DataArray>\n", words.join(" "))
            }
            Format::Base64 => {
                let text = base64(self.packed(&data));
                // VTK keeps notes in arrays.
                format!(
                    "<DataArray {attributes} format=\"binary\">\n  {text}\n<InformationKey name=\"x\">1</InformationKey>\
                     </DataArray>\n"
                )
            }
            Format::Raw | Format::AppendedBase64 => {
                let offset = self.appended.len();
                let packed = self.packed(&data);
                if self.encoding.format == Format::Raw {
                    self.appended.extend(packed.concat());
                } else {
                    self.appended.extend(base64(packed).into_bytes());
                }
                format!("<DataArray {attributes} format=\"appended\" offset=\"{offset}\"/>\n")
            }
        }
    }
}

fn ints(numbers: impl IntoIterator<Item = i64>) -> Vec<(String, Vec<u8>)> {
    numbers.into_iter().map(|n| (n.to_string(), n.to_le_bytes().to_vec())).collect()
}

fn floats(numbers: impl IntoIterator<Item = f64>) -> Vec<(String, Vec<u8>)> {
    numbers.into_iter().map(|n| (n.to_string(), n.to_le_bytes().to_vec())).collect()
}

/// The mesh as a VTU file.
pub fn vtu(mesh: &Mesh, encoding: Encoding) -> Vec<u8> {
    let mut writer = Writer { encoding, appended: Vec::new() };
    let order = if encoding.is_big_endian { "BigEndian" } else { "LittleEndian" };
    let header = if encoding.has_long_sizes { " header_type=\"UInt64\"" } else { "" };
    let compressor = if encoding.is_compressed { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    let tets = mesh.tets.len();
    let low = |node: u32| i64::from(mesh.groups[0].nodes.contains(&node));
    let kinds: Vec<_> = (0..tets).map(|_| ("10".to_owned(), vec![10])).collect();
    let sections = [
        ("PointData", "type=\"Int64\" Name=\"low\"", ints((0..mesh.nodes.len() as u32).map(low))),
        ("PointData", "type=\"Float64\" Name=\"heat\"", floats((0..mesh.nodes.len()).map(|n| n as f64))),
        (
            "CellData",
            "type=\"Int64\" Name=\"Region\" NumberOfComponents=\"1\"",
            ints((0..tets).map(|tet| tag(mesh, tet))),
        ),
        (
            "Points",
            "type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"",
            floats(mesh.nodes.iter().flat_map(|node| node.to_array())),
        ),
        (
            "Cells",
            "type=\"Int64\" Name=\"connectivity\"",
            ints(mesh.tets.iter().flatten().map(|&node| i64::from(node))),
        ),
        ("Cells", "type=\"Int64\" Name=\"offsets\"", ints((1..=tets as i64).map(|at| 4 * at))),
        ("Cells", "type=\"UInt8\" Name=\"types\"", kinds),
    ];
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<!-- a body -->\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\"{header}{compressor}>\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{tets}\">\n",
        mesh.nodes.len()
    );
    for (section, attributes, numbers) in &sections {
        text += &format!("<{section}>\n{}</{section}>\n", writer.array(attributes, numbers));
    }
    text += "</Piece>\n</UnstructuredGrid>\n";
    let kind = if encoding.format == Format::Raw { "raw" } else { "base64" };
    let mut bytes = text.into_bytes();
    if matches!(encoding.format, Format::Raw | Format::AppendedBase64) {
        bytes.extend(format!("<AppendedData encoding=\"{kind}\">\n_").bytes());
        bytes.extend(&writer.appended);
        bytes.extend(b"\n</AppendedData>");
    }
    bytes.extend(b"\n</VTKFile>\n");
    bytes
}

/// All encodings; text has no sizes and no byte order.
pub fn encodings() -> Vec<Encoding> {
    let mut all = Vec::new();
    for format in [Format::Text, Format::Base64, Format::Raw, Format::AppendedBase64] {
        for bits in 0..8 {
            let [is_compressed, is_big_endian, has_long_sizes] = [1, 2, 4].map(|bit| bits & bit != 0);
            all.push(Encoding { format, is_compressed, is_big_endian, has_long_sizes });
        }
    }
    all
}

#[test]
fn every_encoding_gives_the_same_mesh() {
    for encoding in encodings() {
        // Under the wrong name, too.
        let file = volume([("m.vtk", vtu(&body(), encoding))]);
        assert_eq!(file.mesh, body(), "{encoding:?}");
        let packed = if encoding.is_compressed { ", compressed" } else { "" };
        assert_eq!(file.format, format!("VTU 1.0{packed}"));
    }
}

const TEXT: Encoding =
    Encoding { format: Format::Text, is_compressed: false, is_big_endian: false, has_long_sizes: false };

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let text = String::from_utf8(vtu(&body(), TEXT)).expect("text");
    for (from, to, expected) in [
        (
            "UnstructuredGrid\" v",
            "PolyData\" v",
            "line 3: this is a VTK surface (PolyData), expected UnstructuredGrid: a body needs tetrahedra, which gmsh, TetGen or fTetWild make of a surface; ParaView saves it as .stl or .ply for an obstacle",
        ),
        (
            "UnstructuredGrid\" v",
            "PUnstructuredGrid\" v",
            "line 3: this file only names others (PUnstructuredGrid), expected UnstructuredGrid: open it in ParaView and save one .vtu",
        ),
        ("LittleEndian\"", "Little\"", "line 3: byte_order is 'Little', expected LittleEndian or BigEndian"),
        (
            "LittleEndian\"",
            "LittleEndian\" header_type=\"UInt8\"",
            "line 3: header_type is 'UInt8', expected UInt32 or UInt64",
        ),
        (
            "LittleEndian\"",
            "LittleEndian\" compressor=\"vtkLZ4DataCompressor\"",
            "line 3: compressor is 'vtkLZ4DataCompressor', expected vtkZLibDataCompressor: save with zlib or without compression",
        ),
        ("Points=\"27\"", "Points=\"28\"", "line 22: array 'Points' has 81 numbers, expected 84"),
        ("Points=\"27\"", "Points=\"-1\"", "line 5: NumberOfPoints of <Piece> is '-1', expected a number"),
        (
            "Points=\"27\"",
            "Points=\"1152921504606846976\"",
            "line 5: 1152921504606846976 points are more than can be numbered",
        ),
        ("Cells=\"40\"", "Cells=\"41\"", "line 32: array 'offsets' has 40 numbers, expected 41"),
        (
            "\n10 10",
            "\n42 10",
            "line 37: cell 0 is a polyhedron (type 42): expected tetrahedra, hexahedra, wedges or pyramids; ParaView's filter Tetrahedralize makes them",
        ),
        ("\n4 8", "\n-4 8", "line 32: array 'offsets' has -4 after 0: expected to rise, up to 160"),
        ("\n4 8", "\n4 9999", "line 32: array 'offsets' has 9999 after 4: expected to rise, up to 160"),
        ("-0.05 -0.1", "-0.05 red", "line 23: expected a coordinate, found 'red'"),
        ("\"connectivity\"", "\"joints\"", "line 5: the piece has no connectivity"),
        (
            "format=\"ascii\"",
            "format=\"appended\" offset=\"0\"",
            "line 7: array 'low' is appended, and the file has no <AppendedData>",
        ),
        (
            "format=\"ascii\"",
            "format=\"binary\"",
            "line 7: array 'low' is cut: it states 3614793175 bytes, and 16 are left",
        ),
        (
            "</Cells>",
            "</Cell>",
            "line 30: the XML is damaged: ill-formed document: expected `</Cells>`, but `</Cell>` was found",
        ),
        ("</VTKFile>", "", "line 42: the file ends before </VTKFile>"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        assert_eq!(
            refusal([("m.vtu", changed.into_bytes())]),
            format!("m.vtu: {expected}"),
            "{from} -> {to}"
        );
    }
}

#[test]
fn blocks_that_expand_without_end_are_refused_before_they_do() {
    let encoding =
        Encoding { format: Format::Raw, is_compressed: true, is_big_endian: false, has_long_sizes: true };
    let mut bytes = vtu(&body(), encoding);
    let begin = bytes.windows(16).position(|w| w == b"encoding=\"raw\">\n").expect("appended data") + 17;
    // The stated size of the first array's blocks.
    bytes[begin + 8..begin + 16].copy_from_slice(&(1_u64 << 60).to_le_bytes());
    let most = bytes.len() * 100 + (64 << 20);
    assert_eq!(
        refusal([("m.vtu", bytes)]),
        format!(
            "m.vtu: line 7: array 'low' states 1152921504606846976 bytes more: the arrays would expand to more than {most} bytes"
        )
    );
}

#[test]
fn arrays_that_share_their_bytes_without_end_are_refused() {
    let encoding =
        Encoding { format: Format::Raw, is_compressed: false, is_big_endian: false, has_long_sizes: true };
    let bytes = vtu(&body(), encoding);
    let begin = bytes.windows(12).position(|w| w == b"</PointData>").expect("point data");
    let again = "<DataArray type=\"Int64\" Name=\"low\" format=\"appended\" offset=\"0\"/>".repeat(30_000);
    // 216 bytes each, and more than twice the file and a mebibyte together.
    let bytes = [&bytes[..begin], again.as_bytes(), &bytes[begin..]].concat();
    let most = bytes.len() * 2 + (1 << 20);
    assert_eq!(
        refusal([("m.vtu", bytes)]),
        format!(
            "m.vtu: line 8: array 'low' states 216 bytes more: the arrays would expand to more than {most} bytes"
        )
    );
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    for encoding in encodings().into_iter().filter(|encoding| encoding.is_compressed) {
        let bytes = vtu(&body(), encoding);
        let end = bytes.len() - 40;
        for length in (0..end).step_by(7) {
            let cut = read([("m.vtu", bytes[..length].to_vec())]);
            // The last array's last bytes may be line ends and marks.
            assert!(cut.is_err() || length + 60 > bytes.len(), "{length} of {} {encoding:?}", bytes.len());
        }
    }
}

#[test]
fn pieces_are_put_one_after_another() {
    let text = String::from_utf8(vtu(&body(), TEXT)).expect("text");
    let (begin, rest) = text.split_once("<Piece").expect("a piece");
    let (piece, end) = rest.split_once("</Piece>").expect("its end");
    let twice = format!("{begin}<Piece{piece}</Piece><Piece{piece}</Piece>{end}");
    let MeshFile::Volume(file) = read([("m.vtu", twice.into_bytes())]).expect("a good file") else {
        panic!("a surface");
    };
    let (nodes, tets) = (body().nodes.len(), body().tets.len());
    assert_eq!((file.mesh.nodes.len(), file.mesh.tets.len()), (2 * nodes, 2 * tets));
    assert_eq!(file.mesh.tets[tets], body().tets[0].map(|node| node + nodes as u32));
    assert_eq!(file.mesh.groups[0].nodes.len(), 2 * body().groups[0].nodes.len());
    assert_eq!(file.mesh.tet_regions[tets..], body().tet_regions);
}
