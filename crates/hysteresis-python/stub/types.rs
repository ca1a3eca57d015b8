//! Python types that those of Rust tell.

use std::collections::{BTreeSet, HashMap};

use quote::ToTokens;
use syn::Type;

use crate::signature::{arguments, last_name};

/// The names of the crate that types use.
#[derive(Default)]
pub(crate) struct Names {
    pub(crate) aliases: HashMap<String, Type>,
    pub(crate) classes: BTreeSet<String>,
    /// What arguments of a type are in Python, as it says where it says how it is made from them.
    pub(crate) told: HashMap<String, String>,
}

/// A type as text, without the lifetimes.
pub(crate) fn plain(ty: &Type) -> String {
    let inner: Vec<String> = arguments(ty).into_iter().map(plain).collect();
    let name = last_name(ty).unwrap_or_else(|| ty.to_token_stream().to_string());
    if inner.is_empty() { name } else { format!("{name}<{}>", inner.join(", ")) }
}

impl Names {
    /// The Python type of an argument that is made a value of this type, or None if it does not tell.
    pub(crate) fn argument(&self, ty: &Type, class: &str) -> Option<String> {
        match last_name(ty).as_deref() {
            _ if self.told.contains_key(&plain(ty)) => self.told.get(&plain(ty)).cloned(),
            Some("Option") => self.argument(arguments(ty).first()?, class).map(|inner| format!("{inner} | None")),
            Some("Asked") => self.argument(arguments(ty).first()?, class),
            _ => self.python(ty, class),
        }
    }

    /// The Python type of a value of this type, or None if it does not tell. `class` is what `Self` is.
    pub(crate) fn python(&self, ty: &Type, class: &str) -> Option<String> {
        let first = || self.python(arguments(ty).first()?, class);
        let each = |types: &mut dyn Iterator<Item = &Type>| {
            let each: Option<Vec<String>> = types.map(|inner| self.python(inner, class)).collect();
            each.map(|each| each.join(", "))
        };
        match ty {
            Type::Reference(reference) => return self.python(&reference.elem, class),
            Type::Tuple(tuple) if tuple.elems.is_empty() => return Some("None".to_owned()),
            Type::Tuple(tuple) => return each(&mut tuple.elems.iter()).map(|each| format!("tuple[{each}]")),
            Type::Path(_) => {}
            _ => return None,
        }
        let name = last_name(ty)?;
        if let Some(alias) = self.aliases.get(&name) {
            return self.python(alias, class);
        }
        if self.classes.contains(&name) {
            return Some(name);
        }
        let told = match name.as_str() {
            "Self" => class,
            "f64" => "float",
            "bool" => "bool",
            "usize" | "isize" | "u64" | "u32" | "i64" | "i32" | "NonZeroUsize" => "int",
            "str" | "String" => "str",
            "PathBuf" | "Path" => "Path",
            "PyBytes" => "bytes",
            "PyDict" => "dict[str, Any]",
            "PyArray1" | "PyArray2" => return array(&name, ty),
            "Option" => return first().map(|inner| format!("{inner} | None")),
            "Vec" => return first().map(|inner| format!("list[{inner}]")),
            "PyResult" | "Bound" | "Py" | "PyRef" => return first(),
            "HashMap" | "BTreeMap" => return each(&mut arguments(ty).into_iter()).map(|both| format!("dict[{both}]")),
            _ => return None,
        };
        Some(told.to_owned())
    }
}

/// The type of an array of numpy.
fn array(name: &str, ty: &Type) -> Option<String> {
    let element = arguments(ty).first()?.to_token_stream().to_string();
    let told = match (name, element.as_str()) {
        ("PyArray1", "f64") => "Vector",
        ("PyArray2", "f64") => "Matrix",
        (_, "Complex64") => "ComplexVector",
        (_, "bool") => "NDArray[np.bool_]",
        (_, "u64") => "NDArray[np.uint64]",
        (_, "i64") => "NDArray[np.int64]",
        _ => return None,
    };
    Some(told.to_owned())
}
