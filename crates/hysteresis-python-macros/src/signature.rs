//! What Python sees of a function, read from its parameters and their `#[py(...)]`.
//!
//! Both readers use it: the attributes `function` and `methods`, and the writer of the stub.

use syn::parse::{Parse, ParseStream};
use syn::{Expr, FnArg, ImplItem, ImplItemFn, ItemImpl, Lit, LitStr, Pat, Signature, Token, Type, UnOp};

/// One parameter that Python sees.
#[allow(dead_code, reason = "the attributes need no hint, the stub no place")]
#[expect(clippy::struct_excessive_bools, reason = "each is a mark that a parameter has or has not")]
pub(crate) struct Parameter {
    /// Its name in Rust and in Python.
    pub(crate) name: String,
    /// What its argument is converted to.
    pub(crate) ty: Type,
    /// Its Python type, where that of Rust does not tell it.
    pub(crate) hint: Option<String>,
    /// Its default, as an expression of Rust.
    pub(crate) default: Option<Expr>,
    /// Whether it is given by name only.
    pub(crate) is_keyword: bool,
    /// Whether it is given by place only.
    pub(crate) is_positional: bool,
    /// Whether it takes all other arguments that are given by name.
    pub(crate) is_rest: bool,
    /// The field of the options that are gathered which it sets.
    pub(crate) field: Option<String>,
    /// Whether None is a wrong argument, and does not stand for the default.
    pub(crate) refuses_none: bool,
    /// Its place among the parameters of Rust.
    pub(crate) place: usize,
}

/// How a function of Rust is called in Python.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Function,
    Constructor,
    Method,
    ClassMethod,
    StaticMethod,
    Getter,
    Setter,
    /// A method with two underscores on both sides: Python fixes its signature.
    Magic,
}

impl Kind {
    /// The kind of a method.
    pub(crate) fn of(method: &ImplItemFn) -> Self {
        let has = |name| method.attrs.iter().any(|attribute| attribute.path().is_ident(name));
        let name = method.sig.ident.to_string();
        if has("new") {
            Self::Constructor
        } else if has("getter") {
            Self::Getter
        } else if has("setter") {
            Self::Setter
        } else if has("staticmethod") {
            Self::StaticMethod
        } else if has("classmethod") {
            Self::ClassMethod
        } else if name.starts_with("__") {
            Self::Magic
        } else {
            Self::Method
        }
    }
}

/// `#[py(...)]` of a parameter: `*` where those by name begin, `/` behind those by place, `**` for all others by name,
/// `field` of what is gathered or `field(path.to.it)` where that has another name, `not_none` where None does not stand
/// for the default, the Python type, the default.
#[derive(Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a mark that a parameter has or has not")]
struct Said {
    begins_keywords: bool,
    ends_positional: bool,
    is_rest: bool,
    /// The path of a field, empty for one of the name of the parameter.
    field: Option<String>,
    refuses_none: bool,
    hint: Option<String>,
    default: Option<Expr>,
}

impl Parse for Said {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut said = Self::default();
        while !input.is_empty() {
            if input.peek(Token![*]) && input.peek2(Token![*]) {
                input.parse::<Token![*]>()?;
                input.parse::<Token![*]>()?;
                said.is_rest = true;
            } else if input.peek(Token![*]) {
                input.parse::<Token![*]>()?;
                said.begins_keywords = true;
            } else if input.peek(Token![/]) {
                input.parse::<Token![/]>()?;
                said.ends_positional = true;
            } else if input.peek(syn::Ident) {
                let word: syn::Ident = input.parse()?;
                match word.to_string().as_str() {
                    "field" if input.peek(syn::token::Paren) => {
                        let path;
                        syn::parenthesized!(path in input);
                        said.field = Some(path.parse::<proc_macro2::TokenStream>()?.to_string());
                    }
                    "field" => said.field = Some(String::new()),
                    "not_none" => said.refuses_none = true,
                    _ => return Err(syn::Error::new_spanned(word, "expected `field` or `not_none`")),
                }
                // `field = default` as well as `field, "type" = default`.
                if input.peek(Token![=]) {
                    continue;
                }
            } else {
                if input.peek(LitStr) {
                    said.hint = Some(input.parse::<LitStr>()?.value());
                }
                if input.peek(Token![=]) {
                    input.parse::<Token![=]>()?;
                    said.default = Some(input.parse()?);
                }
            }
            if !input.is_empty() {
                input.parse::<Token![,]>()?;
            }
        }
        Ok(said)
    }
}

/// The parameters that Python sees: all but the object, the class and the token of the interpreter.
pub(crate) fn parameters(signature: &Signature) -> syn::Result<Vec<Parameter>> {
    let mut found: Vec<Parameter> = Vec::new();
    let mut is_keyword = false;
    for (place, input) in signature.inputs.iter().enumerate() {
        let FnArg::Typed(typed) = input else { continue };
        let Pat::Ident(pattern) = &*typed.pat else { continue };
        let name = pattern.ident.to_string();
        if name == "slf" || last_name(&typed.ty).is_some_and(|ty| ty == "Python") || is_class(&typed.ty) {
            continue;
        }
        let mut said = Said::default();
        for attribute in &typed.attrs {
            if attribute.path().is_ident("py") {
                said = attribute.parse_args()?;
            }
        }
        is_keyword |= said.begins_keywords;
        if said.ends_positional {
            for before in &mut found {
                before.is_positional = true;
            }
        }
        let Said { hint, default, ends_positional: is_positional, is_rest, field, refuses_none, .. } = said;
        let field = field.map(|path| if path.is_empty() { name.clone() } else { path });
        let ty = (*typed.ty).clone();
        found.push(Parameter {
            name,
            ty,
            hint,
            default,
            is_keyword,
            is_positional,
            is_rest,
            field,
            refuses_none,
            place,
        });
    }
    Ok(found)
}

/// Gives each method with `#[like(other)]` the parameters of the other one of its block, behind the object.
pub(crate) fn fill_alike(block: &mut ItemImpl) -> syn::Result<()> {
    for place in 0..block.items.len() {
        let ImplItem::Fn(method) = &block.items[place] else { continue };
        let Some(at) = method.attrs.iter().position(|attribute| attribute.path().is_ident("like")) else { continue };
        let other: syn::Ident = method.attrs[at].parse_args()?;
        let found = block.items.iter().find_map(|item| match item {
            ImplItem::Fn(method) if method.sig.ident == other => Some(&method.sig.inputs),
            _ => None,
        });
        let found = found.ok_or_else(|| syn::Error::new_spanned(&other, "no method of this block"))?;
        let parameters: Vec<FnArg> = found.iter().skip(1).cloned().collect();
        let ImplItem::Fn(method) = &mut block.items[place] else { continue };
        method.attrs.remove(at);
        method.sig.inputs.extend(parameters);
    }
    Ok(())
}

/// Whether a parameter is the class of a class method.
fn is_class(ty: &Type) -> bool {
    arguments(ty).iter().any(|inner| last_name(inner).is_some_and(|name| name == "PyType"))
}

/// The last name of a type's path: "Option" of `Option<f64>`.
pub(crate) fn last_name(ty: &Type) -> Option<String> {
    match ty {
        Type::Path(path) => path.path.segments.last().map(|segment| segment.ident.to_string()),
        Type::Reference(reference) => last_name(&reference.elem),
        _ => None,
    }
}

/// What stands between the angle brackets of a type, lifetimes left out.
pub(crate) fn arguments(ty: &Type) -> Vec<&Type> {
    let path = match ty {
        Type::Reference(reference) => return arguments(&reference.elem),
        Type::Path(path) => path,
        _ => return Vec::new(),
    };
    let Some(syn::PathArguments::AngleBracketed(inner)) = path.path.segments.last().map(|last| &last.arguments) else {
        return Vec::new();
    };
    let types = inner.args.iter().filter_map(|argument| match argument {
        syn::GenericArgument::Type(ty) => Some(ty),
        _ => None,
    });
    types.collect()
}

/// A default as Python writes it.
pub(crate) fn python_default(default: &Expr) -> syn::Result<String> {
    match default {
        Expr::Lit(literal) => match &literal.lit {
            Lit::Str(text) => Ok(format!("'{}'", text.value())),
            Lit::Bool(truth) => Ok(if truth.value() { "True" } else { "False" }.to_owned()),
            Lit::Int(number) => Ok(number.base10_digits().to_owned()),
            Lit::Float(number) => Ok(number.base10_digits().to_owned()),
            _ => Err(syn::Error::new_spanned(default, "no default that Python could write")),
        },
        Expr::Path(path) if path.path.is_ident("None") => Ok("None".to_owned()),
        Expr::Unary(negative) if matches!(negative.op, UnOp::Neg(_)) => {
            Ok(format!("-{}", python_default(&negative.expr)?))
        }
        Expr::Tuple(tuple) => {
            let each: Vec<String> = tuple.elems.iter().map(python_default).collect::<syn::Result<_>>()?;
            Ok(format!("({})", each.join(", ")))
        }
        _ => Err(syn::Error::new_spanned(default, "no default that Python could write")),
    }
}

/// The list of parameters between the parentheses, each as `show` writes it, with the marks of Python between them.
pub(crate) fn list(
    first: Option<&str>,
    parameters: &[Parameter],
    mut show: impl FnMut(&Parameter) -> syn::Result<String>,
) -> syn::Result<String> {
    let mut shown: Vec<String> = first.map(str::to_owned).into_iter().collect();
    let mut has_star = false;
    for (i, parameter) in parameters.iter().enumerate() {
        if parameter.is_keyword && !has_star {
            shown.push("*".to_owned());
            has_star = true;
        }
        shown.push(if parameter.is_rest { format!("**{}", show(parameter)?) } else { show(parameter)? });
        if parameter.is_positional && !parameters.get(i + 1).is_some_and(|next| next.is_positional) {
            shown.push("/".to_owned());
        }
    }
    Ok(shown.join(", "))
}
