//! The text of the stub.

use std::collections::{BTreeMap, BTreeSet};

use syn::parse::{Parse, ParseStream, Parser};
use syn::punctuated::Punctuated;
use syn::{
    Attribute, Expr, File, ImplItemFn, Item, ItemImpl, ItemStruct, Lit, LitStr, Macro, Meta, ReturnType, Signature,
    Token, Type, UseTree,
};

use crate::signature::{Kind, Parameter, last_name, list, parameters, python_default};
use crate::types::{Names, plain};

/// What the types use, and where it is from.
const IMPORTS: [(&str, &[&str]); 8] = [
    ("collections.abc", &["Callable", "Iterable", "Sequence"]),
    ("concurrent.futures", &["Executor"]),
    ("os", &["PathLike"]),
    ("pathlib", &["Path"]),
    ("typing", &["Any", "Literal", "SupportsIndex", "final", "overload"]),
    ("matplotlib.axes", &["Axes"]),
    ("matplotlib.figure", &["Figure"]),
    ("numpy.typing", &["ArrayLike", "NDArray"]),
];

/// Members that Python has by other means than a method of their name.
const EQUAL: &str =
    "    def __eq__(self, other: object, /) -> bool: ...\n    def __ne__(self, other: object, /) -> bool: ...\n";
const HASH: &str = "    def __hash__(self, /) -> int: ...\n";
const LENGTH: &str = "    def __len__(self) -> int: ...\n";

/// The text of a member, by its name. A setter follows its getter.
type Members = BTreeMap<String, String>;

#[derive(Default)]
struct Stub {
    names: Names,
    classes: BTreeMap<String, (String, Members)>,
    /// Functions and exceptions.
    others: Members,
    exported: BTreeSet<String>,
    problems: Vec<String>,
}

/// The stub, or what is wrong. `shared` is the text of the module with the types that several signatures use.
pub(crate) fn stub(files: &[File], shared: &str) -> Result<String, Vec<String>> {
    let mut stub = Stub::default();
    let items = || files.iter().flat_map(|file| &file.items);
    for item in items() {
        match item {
            Item::Type(alias) => drop(stub.names.aliases.insert(alias.ident.to_string(), (*alias.ty).clone())),
            Item::Struct(class) if has(&class.attrs, "pyclass") => {
                stub.names.classes.insert(class.ident.to_string());
            }
            Item::Impl(block) => stub.argument(block),
            _ => {}
        }
    }
    for item in items() {
        match item {
            Item::Struct(class) if has(&class.attrs, "pyclass") => stub.class(class),
            Item::Fn(function) if has(&function.attrs, "function") => {
                let text = stub.function("", Kind::Function, &function.attrs, &function.sig);
                stub.others.insert(function.sig.ident.to_string(), text);
            }
            Item::Mod(module) if module.ident == "_core" => {
                for item in module.content.iter().flat_map(|(_, items)| items) {
                    stub.export(item);
                }
            }
            Item::Macro(made) if made.mac.path.is_ident("create_exception") => stub.exception(&made.mac),
            _ => {}
        }
    }
    for item in items() {
        let Item::Impl(block) = item else { continue };
        for class in classes_of(block) {
            stub.methods(&class, block);
        }
        if block.trait_.as_ref().is_some_and(|(_, path, _)| path.is_ident("Stepper")) {
            let class = last_name(&block.self_ty).unwrap_or_default();
            items().for_each(|item| stub.step_or_peek(&class, item));
        }
    }
    if stub.problems.is_empty() { Ok(stub.text(shared)) } else { Err(stub.problems) }
}

fn has(attributes: &[Attribute], name: &str) -> bool {
    attributes.iter().any(|attribute| attribute.path().is_ident(name))
}

/// `#[py(-> "...")]` of a function: the Python type of its result, where that of Rust does not tell it.
struct Returns(String);

impl Parse for Returns {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        input.parse::<Token![->]>()?;
        Ok(Self(input.parse::<LitStr>()?.value()))
    }
}

/// The Python type of the result that stands at a function.
fn returns(attributes: &[Attribute]) -> syn::Result<Option<String>> {
    let said = attributes.iter().find(|attribute| attribute.path().is_ident("py"));
    said.map(|attribute| attribute.parse_args::<Returns>().map(|Returns(hint)| hint)).transpose()
}

/// The signatures that stand at a function, one `#[overload("(...) -> ...")]` each.
fn overloads(attributes: &[Attribute]) -> syn::Result<Vec<String>> {
    let said = attributes.iter().filter(|attribute| attribute.path().is_ident("overload"));
    said.map(|attribute| attribute.parse_args::<LitStr>().map(|text| text.value())).collect()
}

/// The name that Python has for a getter, if it is another one.
fn renamed(attributes: &[Attribute]) -> Option<String> {
    let getter = attributes.iter().find(|attribute| attribute.path().is_ident("getter"))?;
    getter.meta.require_list().ok().map(|list| list.tokens.to_string())
}

/// The classes that a block of methods is for.
fn classes_of(block: &ItemImpl) -> Vec<String> {
    let Some(methods) = block.attrs.iter().find(|attribute| attribute.path().is_ident("methods")) else {
        return Vec::new();
    };
    match &methods.meta {
        Meta::List(several) => {
            let names = several.tokens.to_string();
            names.split(',').map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect()
        }
        _ => last_name(&block.self_ty).into_iter().collect(),
    }
}

/// A string behind the attribute `py`, such as the Python type of an argument.
fn said(attributes: &[Attribute]) -> Option<String> {
    let said = attributes.iter().find(|attribute| attribute.path().is_ident("py"))?;
    said.parse_args::<LitStr>().map(|text| text.value()).ok()
}

/// The words of `impl Words`, as Python writes the type.
fn words(block: &ItemImpl) -> Option<String> {
    let syn::ImplItem::Const(constant) = block.items.first()? else { return None };
    let Expr::Reference(array) = &constant.expr else { return None };
    let Expr::Array(array) = &*array.expr else { return None };
    let word = |pair: &Expr| match pair {
        Expr::Tuple(pair) => pair.elems.first().map(python_default)?.ok(),
        _ => None,
    };
    array.elems.iter().map(word).collect::<Option<Vec<_>>>().map(|words| format!("Literal[{}]", words.join(", ")))
}

impl Stub {
    /// The Python type that arguments have from which a type of Rust is made, if the block says so.
    fn argument(&mut self, block: &ItemImpl) {
        let made = block.trait_.as_ref().and_then(|(_, path, _)| path.segments.last());
        let told = match made.map(|last| last.ident.to_string()).as_deref() {
            Some("Argument") => said(&block.attrs),
            Some("Words") => words(block),
            _ => None,
        };
        if let Some(told) = told {
            self.names.told.insert(plain(&block.self_ty), told);
        }
    }

    fn class(&mut self, class: &ItemStruct) {
        let name = class.ident.to_string();
        let said = class.attrs.iter().find(|attribute| attribute.path().is_ident("pyclass"));
        let said = said.and_then(|attribute| attribute.meta.require_list().ok()).map(|list| list.tokens.to_string());
        let said = said.unwrap_or_default();
        let words: BTreeSet<&str> = said.split(',').map(str::trim).collect();
        let mut members = Members::new();
        if words.contains("eq") {
            members.insert("__eq__".to_owned(), EQUAL.to_owned());
        }
        if words.contains("hash") {
            members.insert("__hash__".to_owned(), HASH.to_owned());
        }
        let shown = |field: &&syn::Field| words.contains("get_all") || has(&field.attrs, "pyo3");
        for field in class.fields.iter().filter(shown) {
            let field_name = field.ident.as_ref().map(ToString::to_string).unwrap_or_default();
            let ty = self.said_or_told(&name, &field_name, &field.attrs, &field.ty);
            members.insert(field_name.clone(), property(&field_name, &ty, &field.attrs));
        }
        self.classes.insert(name, (doc(&class.attrs), members));
    }

    fn methods(&mut self, class: &str, block: &ItemImpl) {
        for item in &block.items {
            let syn::ImplItem::Fn(method) = item else { continue };
            let kind = Kind::of(method);
            let name = method.sig.ident.to_string();
            let (name, text) = match kind {
                Kind::Setter => {
                    let name = name.strip_prefix("set_").unwrap_or(&name).to_owned();
                    let text = self.setter(class, &name, method);
                    (name, text)
                }
                Kind::Getter => {
                    let name = renamed(&method.attrs).unwrap_or(name);
                    let text = self.getter(class, &name, method);
                    (name, text)
                }
                Kind::Magic => match self.magic(class, &name, method) {
                    Some(text) => (name, text),
                    None => continue,
                },
                _ if name.starts_with('_') && name != "_repr_html_" => continue,
                Kind::Constructor => ("__new__".to_owned(), self.function(class, kind, &method.attrs, &method.sig)),
                _ => (name, self.function(class, kind, &method.attrs, &method.sig)),
            };
            let Some((_, members)) = self.classes.get_mut(class) else { continue };
            let before = members.entry(name).or_default();
            // A getter comes before its setter, wherever it stands.
            *before = if kind == Kind::Setter { format!("{before}{text}") } else { format!("{text}{before}") };
        }
    }

    fn getter(&mut self, class: &str, name: &str, method: &ImplItemFn) -> String {
        let ty = self.returned(class, name, &method.attrs, &method.sig);
        property(name, &ty, &method.attrs)
    }

    fn setter(&mut self, class: &str, name: &str, method: &ImplItemFn) -> String {
        let shown = match parameters(&method.sig).as_deref() {
            Ok([value]) => self.parameter(class, name, value),
            _ => self.problem(class, name, "what is set"),
        };
        format!("    @{name}.setter\n    def {name}(self, {shown}) -> None: ...\n")
    }

    /// A method with two underscores on both sides, if a type checker asks for it.
    fn magic(&mut self, class: &str, name: &str, method: &ImplItemFn) -> Option<String> {
        match name {
            "__eq__" => Some(EQUAL.to_owned()),
            "__hash__" => Some(HASH.to_owned()),
            "__len__" => Some(LENGTH.to_owned()),
            "__repr__" | "__reduce__" | "__setstate__" | "__getnewargs__" => None,
            _ => Some(self.function(class, Kind::Magic, &method.attrs, &method.sig)),
        }
    }

    fn function(&mut self, class: &str, kind: Kind, attributes: &[Attribute], signature: &Signature) -> String {
        let name = if kind == Kind::Constructor { "__new__".to_owned() } else { signature.ident.to_string() };
        let indent = if class.is_empty() { "" } else { "    " };
        let text =
            quoted(if kind == Kind::Constructor { String::new() } else { doc(attributes) }, &format!("{indent}    "));
        let decorator = match kind {
            Kind::ClassMethod => format!("{indent}@classmethod\n"),
            Kind::StaticMethod => format!("{indent}@staticmethod\n"),
            _ => String::new(),
        };
        match overloads(attributes) {
            Ok(overloads) if overloads.is_empty() => {}
            Ok(overloads) => {
                let each = overloads.iter().map(|said| {
                    let (said, comment) = said.split_at(said.find("  #").unwrap_or(said.len()));
                    format!("{indent}@overload\n{indent}def {name}{said}:{comment}{text}")
                });
                return each.collect();
            }
            Err(_) => return self.problem(class, &name, "an overload"),
        }
        let first = match kind {
            Kind::Constructor | Kind::ClassMethod => Some("cls"),
            Kind::Method | Kind::Magic => Some("self"),
            _ => None,
        };
        let Ok(seen) = parameters(signature) else { return self.problem(class, &name, "its parameters") };
        let shown = list(first, &seen, |parameter| Ok(self.parameter(class, &name, parameter))).unwrap_or_default();
        let returns = match kind {
            Kind::Constructor => class.to_owned(),
            _ => self.returned(class, &name, attributes, signature),
        };
        format!("{decorator}{indent}def {name}({shown}) -> {returns}:{text}")
    }

    fn parameter(&mut self, class: &str, function: &str, parameter: &Parameter) -> String {
        let Parameter { name, ty, hint, default, .. } = parameter;
        let hint = hint.clone().or_else(|| self.names.argument(ty, class));
        let hint = hint.unwrap_or_else(|| self.problem(class, function, &format!("the parameter {name}")));
        match default.as_ref().map(python_default) {
            None => format!("{name}: {hint}"),
            Some(Ok(default)) => format!("{name}: {hint} = {default}"),
            Some(Err(_)) => self.problem(class, function, &format!("the default of {name}")),
        }
    }

    fn returned(&mut self, class: &str, name: &str, attributes: &[Attribute], signature: &Signature) -> String {
        match &signature.output {
            ReturnType::Default => "None".to_owned(),
            ReturnType::Type(_, ty) => self.said_or_told(class, name, attributes, ty),
        }
    }

    fn said_or_told(&mut self, class: &str, name: &str, attributes: &[Attribute], ty: &Type) -> String {
        let said = returns(attributes).ok().flatten();
        let hint = said.or_else(|| self.names.python(ty, class));
        hint.unwrap_or_else(|| self.problem(class, name, "its value"))
    }

    fn problem(&mut self, class: &str, name: &str, what: &str) -> String {
        let dot = if class.is_empty() { "" } else { "." };
        self.problems.push(format!("{class}{dot}{name}: the Python type of {what} is not told, say it by #[py(...)]"));
        "Any".to_owned()
    }

    /// A method that `single_argument` gives to the class, if the constant is its definition.
    fn step_or_peek(&mut self, class: &str, item: &Item) {
        let Item::Const(constant) = item else { return };
        let Expr::Lit(literal) = &*constant.expr else { return };
        let Lit::CStr(text) = &literal.lit else { return };
        let text = text.value().to_string_lossy().into_owned();
        let Some((call, doc)) = text.split_once("\n--\n\n") else { return };
        let Some((name, _)) = call.split_once('(') else { return };
        let Some((_, members)) = self.classes.get_mut(class) else { return };
        let shown = quoted(doc.to_owned(), "        ");
        members.insert(name.to_owned(), format!("    def {name}(self, sample: float, /) -> float:{shown}"));
    }

    /// What the module exports.
    fn export(&mut self, item: &Item) {
        match item {
            Item::Use(used) if has(&used.attrs, "pymodule_export") => names_of(&used.tree, &mut self.exported),
            _ => {}
        }
    }

    fn exception(&mut self, made: &Macro) {
        let Ok(parts) = Punctuated::<Expr, Token![,]>::parse_terminated.parse2(made.tokens.clone()) else { return };
        let parts: Vec<&Expr> = parts.iter().collect();
        let [_, Expr::Path(name), Expr::Path(base), Expr::Lit(text)] = parts[..] else { return };
        let (Some(name), Some(base), Lit::Str(text)) = (name.path.get_ident(), base.path.get_ident(), &text.lit) else {
            return;
        };
        let base = base.to_string();
        let base = base.strip_prefix("Py").unwrap_or(&base);
        let text = quoted(text.value(), "    ");
        self.others.insert(name.to_string(), format!("class {name}({base}):{text}"));
    }

    fn text(&self, shared: &str) -> String {
        let mut body = String::new();
        for (name, (doc, members)) in &self.classes {
            body.extend(["@final\nclass ", name, ":", &quoted(doc.clone(), "    ")]);
            body.extend(members.values().flat_map(|text| ["\n", text]));
            body.push('\n');
        }
        body.extend(self.others.values().flat_map(|text| [text, "\n"]));
        let mut imports = String::new();
        for (module, names) in IMPORTS {
            imports += &import(module, names.iter().copied(), &body);
        }
        imports += "import numpy as np\n";
        imports += &import("mpi_hyst._types", defined(shared).into_iter(), &body);
        let exported: Vec<String> = self.exported.iter().map(|name| format!("    \"{name}\",\n")).collect();
        let all = format!("__all__ = [\n    \"__version__\",\n{}]\n", exported.concat());
        format!(
            "# Written by the build script of the binding from its sources.\n\n{imports}\n{all}\n__version__: str\n\n{body}"
        )
    }
}

/// The import of those names that the text uses.
fn import<'a>(module: &str, names: impl Iterator<Item = &'a str>, text: &str) -> String {
    let words: BTreeSet<&str> = text.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    let used: Vec<&str> = names.filter(|name| words.contains(name)).collect();
    if used.is_empty() { String::new() } else { format!("from {module} import {}\n", used.join(", ")) }
}

/// The names that a Python module defines: types and protocols.
fn defined(module: &str) -> Vec<&str> {
    module
        .lines()
        .filter_map(|line| line.strip_prefix("class ").or_else(|| line.contains(": TypeAlias = ").then_some(line)))
        .map(|line| line.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default())
        .collect()
}

fn names_of(tree: &UseTree, found: &mut BTreeSet<String>) {
    match tree {
        UseTree::Path(path) => names_of(&path.tree, found),
        UseTree::Name(name) => drop(found.insert(name.ident.to_string())),
        UseTree::Group(group) => group.items.iter().for_each(|item| names_of(item, found)),
        UseTree::Rename(_) | UseTree::Glob(_) => {}
    }
}

fn property(name: &str, ty: &str, attributes: &[Attribute]) -> String {
    format!("    @property\n    def {name}(self) -> {ty}:{}", quoted(doc(attributes), "        "))
}

/// The docstring of an item.
fn doc(attributes: &[Attribute]) -> String {
    let said = attributes.iter().filter(|attribute| attribute.path().is_ident("doc"));
    let lines: Vec<String> = said
        .filter_map(|attribute| {
            let Expr::Lit(literal) = &attribute.meta.require_name_value().ok()?.value else { return None };
            let Lit::Str(text) = &literal.lit else { return None };
            let line = text.value();
            Some(line.strip_prefix(' ').unwrap_or(&line).trim_end().to_owned())
        })
        .collect();
    lines.join("\n").trim().to_owned()
}

/// A docstring as source, behind a colon; `...` without one.
fn quoted(doc: String, indent: &str) -> String {
    if doc.is_empty() {
        return " ...\n".to_owned();
    }
    let raw = if doc.contains('\\') { "r" } else { "" };
    // A quote would be a fourth one.
    let gap = if doc.starts_with('"') { " " } else { "" };
    let lines: Vec<String> = doc.lines().map(|line| format!("{indent}{line}").trim_end().to_owned()).collect();
    let end = if lines.len() > 1 || doc.ends_with('"') { format!("\n{indent}") } else { String::new() };
    format!("\n{indent}{raw}\"\"\"{gap}{}{end}\"\"\"\n", lines.join("\n").trim_start())
}
