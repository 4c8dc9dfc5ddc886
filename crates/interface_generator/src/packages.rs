//! Folders of interface files: reading them, finding what a field's type means, refusing what cannot be built.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::model::{Element, Interface, Kind, Message, TypeName};
use crate::names::is_lower_name;
use crate::parser::parse_interface;

/// Interface packages and everything they refer to.
#[derive(Debug, Default, Clone)]
pub struct Packages {
    packages: BTreeMap<String, Vec<Interface>>,
    sources: Vec<PathBuf>,
}

impl Packages {
    /// No package yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Reads the package in `folder`: `msg/*.msg`, `srv/*.srv` and `action/*.action`, as `package`.
    pub fn add_folder(&mut self, package: &str, folder: &Path) -> Result<(), Error> {
        let mut interfaces = Vec::new();
        self.sources.push(folder.to_owned());
        for kind in Kind::ALL {
            let folder = folder.join(kind.name());
            if folder.is_dir() {
                self.sources.push(folder.clone());
                for path in interface_files(&folder, kind)? {
                    interfaces.push(read_interface(&path, package, kind)?);
                    self.sources.push(path);
                }
            }
        }
        self.add_interfaces(package, interfaces)
    }

    /// Adds a package that was read in another way.
    pub fn add_interfaces(&mut self, package: &str, interfaces: Vec<Interface>) -> Result<(), Error> {
        if !is_lower_name(package) {
            return Err(Error::PackageName {
                found: package.to_owned(),
            });
        }
        check_rust_names(package, &interfaces)?;
        match self.packages.insert(package.to_owned(), interfaces) {
            None => Ok(()),
            Some(_) => Err(Error::PackageTwice {
                package: package.to_owned(),
            }),
        }
    }

    /// Every file and folder that was read: what a build script must watch.
    pub fn sources(&self) -> &[PathBuf] {
        &self.sources
    }

    /// The packages' names, sorted.
    pub fn names(&self) -> Vec<String> {
        self.packages.keys().cloned().collect()
    }

    /// The interfaces of one package, sorted by kind and name.
    pub fn interfaces(&self, package: &str) -> Result<&[Interface], Error> {
        self.packages
            .get(package)
            .map(Vec::as_slice)
            .ok_or_else(|| Error::UnknownPackage {
                found: package.to_owned(),
                known: self.names(),
            })
    }

    /// Makes every field's type point at a message that exists, and refuses messages that contain themselves.
    pub fn resolve(&mut self) -> Result<(), Error> {
        let unresolved = self.clone();
        let parts = self
            .packages
            .values_mut()
            .flatten()
            .flat_map(|interface| &mut interface.parts);
        for part in parts {
            unresolved.resolve_part(part)?;
        }
        let mut settled = Vec::new();
        for part in self.parts() {
            self.check_recursion(part, &mut Vec::new(), &mut settled)?;
        }
        Ok(())
    }

    /// The messages `message` needs, each once, in the order they are first met, nested ones included.
    ///
    /// Call [`Packages::resolve`] first; before that, types that do not exist are left out.
    pub fn dependencies<'a>(&'a self, message: &'a Message) -> Vec<&'a Message> {
        let mut found: Vec<&Message> = Vec::new();
        let mut waiting: Vec<&TypeName> = used_types(message).rev().collect();
        while let Some(name) = waiting.pop() {
            if let Some(next) = self.message(name).filter(|next| !found.contains(next)) {
                found.push(next);
                waiting.extend(used_types(next).rev());
            }
        }
        found
    }

    fn parts(&self) -> impl Iterator<Item = &Message> {
        self.packages.values().flatten().flat_map(|interface| &interface.parts)
    }

    fn message(&self, name: &TypeName) -> Option<&Message> {
        let interfaces = self.packages.get(&name.package)?;
        interfaces
            .iter()
            .flat_map(|interface| &interface.parts)
            .find(|part| part.name == *name)
    }

    fn resolve_part(&self, part: &mut Message) -> Result<(), Error> {
        for field in &mut part.fields {
            let Element::Message(name) = &mut field.element else {
                continue;
            };
            // The one shorthand of old that is still met: a bare `Header` is std_msgs' unless the package has its own.
            if self.message(name).is_none() && name.name == "Header" && name.package == part.name.package {
                "std_msgs".clone_into(&mut name.package);
            }
            if self.message(name).is_none() {
                let (file, line) = (part.file.clone(), field.line);
                return Err(Error::UnknownType {
                    file,
                    line,
                    found: name.to_string(),
                    known: self.names(),
                });
            }
        }
        Ok(())
    }

    fn check_recursion<'a>(
        &'a self,
        message: &'a Message,
        path: &mut Vec<&'a TypeName>,
        settled: &mut Vec<&'a TypeName>,
    ) -> Result<(), Error> {
        if settled.contains(&&message.name) {
            return Ok(());
        }
        let seen = path.iter().position(|name| **name == message.name);
        path.push(&message.name);
        if let Some(start) = seen {
            return Err(Error::Recursive {
                cycle: path[start..].iter().map(ToString::to_string).collect(),
            });
        }
        for next in used_types(message).filter_map(|name| self.message(name)) {
            self.check_recursion(next, path, settled)?;
        }
        path.pop();
        settled.push(&message.name);
        Ok(())
    }
}

fn used_types(message: &Message) -> impl DoubleEndedIterator<Item = &TypeName> {
    message.fields.iter().filter_map(|field| match &field.element {
        Element::Message(name) => Some(name),
        _ => None,
    })
}

/// The files of one kind in `folder`, sorted so that the output is the same everywhere.
fn interface_files(folder: &Path, kind: Kind) -> Result<Vec<PathBuf>, Error> {
    let unreadable = |source| Error::Read {
        path: folder.to_owned(),
        source,
    };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let extension = path.extension().and_then(|extension| extension.to_str());
        if extension == Some("idl") {
            return Err(Error::Idl { path });
        }
        if extension == Some(kind.name()) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn read_interface(path: &Path, package: &str, kind: Kind) -> Result<Interface, Error> {
    let text = fs::read_to_string(path).map_err(|source| Error::Read {
        path: path.to_owned(),
        source,
    })?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    parse_interface(&path.display().to_string(), package, kind, &name, &text)
}

/// `Foo.srv` makes `FooRequest`, and so would `FooRequest.srv`.
fn check_rust_names(package: &str, interfaces: &[Interface]) -> Result<(), Error> {
    let mut owners: BTreeMap<(Kind, String), &TypeName> = BTreeMap::new();
    for interface in interfaces {
        let own_name = (interface.name.kind != Kind::Msg).then_some(&interface.name);
        for name in own_name
            .into_iter()
            .chain(interface.parts.iter().map(|part| &part.name))
        {
            let rust_name = name.rust_name();
            if let Some(first) = owners.insert((name.kind, rust_name.clone()), name) {
                let (package, first, second) = (package.to_owned(), first.to_string(), name.to_string());
                return Err(Error::NameClash {
                    package,
                    first,
                    second,
                    rust_name,
                });
            }
        }
    }
    Ok(())
}
