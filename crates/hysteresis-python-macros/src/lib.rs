//! `#[function]` and `#[methods]`: each parameter is said once, where Rust has it.
//!
//! ```ignore
//! /// A sine.
//! #[function]
//! fn sine<'py>(
//!     py: Python<'py>,
//!     amplitude: f64,
//!     #[py(*)] seconds: f64,                                            // from here on by name only
//!     #[py(= 10000.0)] rate: f64,                                       // with a default
//!     #[py("Literal['linear', 'logarithmic']" = "linear")] sweep: Sweep, // with a type that Rust does not tell
//! ) -> PyResult<Bound<'py, PyArray1<f64>>> { ... }
//! ```
//!
//! is a `#[pyfunction]` with the signature that `help` shows. Each argument comes as any object of Python and is
//! converted by `Argument` of its Rust type, which gets its name: an error tells it. The default that is written is the
//! one that takes effect: it is converted like an argument. Objects of Python and options of them (`&Bound<'_, PyAny>`)
//! are handed on as they are.
//!
//! None that is given stands for the default, unless it is a value of the type, or the parameter says `not_none`.
//!
//! A new option of a call is one such line where the options are gathered: of a function with `#[gather(options: Options)]` the
//! parameters with `#[py(field, ...)]` are fields of the value `options`.
//!
//! `#[methods]` stands in place of `#[pymethods]` and does the same for all methods of a block. `#[methods(A, B)]` gives the block
//! to several classes: what they share is written once.
//!
//! `#[py(-> "type")]` at a function says its result where Rust does not, and `#[py("type")]` at `impl Argument for T` what every
//! parameter of the type T takes. Only the stub, which the build script of the binding writes, reads them.

mod signature;

use proc_macro::TokenStream;
use quote::{ToTokens, format_ident, quote};
use signature::{Kind, Parameter, arguments, last_name, list, parameters, python_default};
use syn::parse::{Parse, ParseStream};
use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, FnArg, Ident, ImplItem, ItemFn, ItemImpl, Lit, Signature, Token, Type, parse_quote};

/// A function of the module.
#[proc_macro_attribute]
pub fn function(_: TokenStream, item: TokenStream) -> TokenStream {
    let mut function = syn::parse_macro_input!(item as ItemFn);
    let done = converted(Kind::Function, &mut function.attrs, &mut function.sig).map(|conversions| {
        function.block.stmts.splice(0..0, conversions);
        quote!(#[pyo3::pyfunction] #function)
    });
    done.unwrap_or_else(|error| error.to_compile_error()).into()
}

/// Methods of a class, or of each of several classes.
#[proc_macro_attribute]
pub fn methods(classes: TokenStream, item: TokenStream) -> TokenStream {
    let classes = syn::parse_macro_input!(classes with Punctuated::<Ident, Token![,]>::parse_terminated);
    let mut block = syn::parse_macro_input!(item as ItemImpl);
    for item in &mut block.items {
        let ImplItem::Fn(method) = item else { continue };
        match converted(Kind::of(method), &mut method.attrs, &mut method.sig) {
            Ok(conversions) => drop(method.block.stmts.splice(0..0, conversions)),
            Err(error) => return error.to_compile_error().into(),
        }
    }
    if classes.is_empty() {
        return quote!(#[pyo3::pymethods] #block).into();
    }
    let each = classes.iter().map(|class| {
        block.self_ty = parse_quote!(#class);
        quote!(#[pyo3::pymethods] #block)
    });
    quote!(#(#each)*).into()
}

/// `#[py("type")] impl Argument for T`: the Python type of what a T is made from.
#[proc_macro_attribute]
pub fn py(_: TokenStream, item: TokenStream) -> TokenStream {
    item
}

/// Makes the attributes and parameters those of pyo3. The statements convert what came.
fn converted(kind: Kind, attributes: &mut Vec<Attribute>, signature: &mut Signature) -> syn::Result<Vec<syn::Stmt>> {
    let seen = parameters(signature)?;
    let gathered = attributes.iter().find(|attribute| attribute.path().is_ident("gather"));
    let gathered = gathered.map(Attribute::parse_args::<Gathered>).transpose()?;
    attributes.retain(|attribute| !["py", "overload", "gather"].iter().any(|name| attribute.path().is_ident(name)));
    // What Python calls for the package alone stays as pyo3 has it.
    let is_private = signature.ident.to_string().starts_with('_');
    let mut conversions = Vec::new();
    for parameter in &seen {
        let FnArg::Typed(typed) = &mut signature.inputs[parameter.place] else { continue };
        typed.attrs.retain(|attribute| !attribute.path().is_ident("py"));
        if is_private || is_object(&parameter.ty) {
            continue;
        }
        conversions.push(conversion(parameter));
        let py = lifetime(&parameter.ty);
        *typed.ty = match parameter.default {
            Some(_) => parse_quote!(crate::argument::Given<'_, #py>),
            None => parse_quote!(&pyo3::Bound<#py, pyo3::PyAny>),
        };
    }
    if let Some(Gathered { name, ty, base }) = gathered {
        let fields = seen.iter().filter(|parameter| parameter.is_field);
        let fields = fields.map(|parameter| format_ident!("{}", parameter.name));
        conversions.push(parse_quote! {
            #[allow(clippy::needless_update, reason = "the base of options of which every field is gathered")]
            let #name = #ty { #(#fields,)* ..#base };
        });
    }
    if seen.is_empty() || is_private || matches!(kind, Kind::Getter | Kind::Setter | Kind::Magic) {
        return Ok(conversions);
    }
    let first = match kind {
        Kind::Method => Some("$self"),
        Kind::ClassMethod => Some("$cls"),
        _ => None,
    };
    let text = list(first, &seen, |parameter| match &parameter.default {
        Some(default) => Ok(format!("{}={}", parameter.name, python_default(default)?)),
        None => Ok(parameter.name.clone()),
    })?;
    let text = format!("({text})");
    let signature = list(None, &seen, |parameter| match &parameter.default {
        _ if parameter.is_rest => Ok(parameter.name.clone()),
        Some(_) => Ok(format!("{}={}", parameter.name, absent(&parameter.ty))),
        None => Ok(parameter.name.clone()),
    })?;
    let signature: proc_macro2::TokenStream = signature.parse()?;
    attributes.push(parse_quote!(#[pyo3(signature = (#signature), text_signature = #text)]));
    // The list of Python is as long as it is.
    attributes.push(parse_quote!(#[allow(clippy::too_many_arguments)]));
    Ok(conversions)
}

/// `#[gather(name: Type = base)]`: the options that the parameters with `field` are fields of. What is none of them is as in the base,
/// by default that of the type.
struct Gathered {
    name: Ident,
    ty: syn::Path,
    base: Expr,
}

impl Parse for Gathered {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let name = input.parse()?;
        input.parse::<Token![:]>()?;
        let ty = input.parse()?;
        let base = if input.peek(Token![=]) {
            input.parse::<Token![=]>()?;
            input.parse()?
        } else {
            parse_quote!(Default::default())
        };
        Ok(Self { name, ty, base })
    }
}

/// Whether an argument is handed on as the object that it is.
fn is_object(ty: &Type) -> bool {
    match last_name(ty).as_deref() {
        // Objects of a class of the package are checked to be of it.
        Some("Bound" | "Py") => {
            arguments(ty).iter().any(|inner| last_name(inner).is_some_and(|name| name.starts_with("Py")))
        }
        Some("Option") => arguments(ty).first().is_some_and(|inner| is_object(inner)),
        _ => false,
    }
}

/// The lifetime of what a value holds of Python, if it has a name.
fn lifetime(ty: &Type) -> proc_macro2::TokenStream {
    let text = ty.to_token_stream().to_string();
    let named =
        text.split('\'').skip(1).map(|rest| rest.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default());
    let named = named.into_iter().find(|name| !name.is_empty()).map_or("'_".to_owned(), |name| format!("'{name}"));
    named.parse().expect("a lifetime")
}

/// What stands for an argument that is not given.
fn absent(ty: &Type) -> &'static str {
    match last_name(ty).as_deref() {
        Some("Option") if is_object(ty) => "None",
        _ => "crate::argument::Given::Default",
    }
}

/// The statement that makes a value of what came.
fn conversion(parameter: &Parameter) -> syn::Stmt {
    let Parameter { name: text, ty, default, .. } = parameter;
    let name = format_ident!("{text}");
    let or = format_ident!("{}", if parameter.refuses_none { "or_unless_given" } else { "or" });
    match default {
        None => parse_quote! { let #name: #ty = crate::argument::Argument::from_argument(#text, #name)?; },
        Some(Expr::Path(_)) if last_name(ty).as_deref() != Some("Option") => {
            parse_quote! { let #name: #ty = #name.#or(#text, || crate::argument::of_default(#text, None::<bool>))?; }
        }
        Some(default) if is_of_type(default, ty) => {
            parse_quote! { let #name: #ty = #name.#or(#text, || Ok(#default))?; }
        }
        Some(default) => {
            parse_quote! { let #name: #ty = #name.#or(#text, || crate::argument::of_default(#text, #default))?; }
        }
    }
}

/// Whether a default is of the type as it is written.
fn is_of_type(default: &Expr, ty: &Type) -> bool {
    let literal = match default {
        Expr::Lit(literal) => &literal.lit,
        Expr::Path(_) => return true,
        _ => return false,
    };
    match literal {
        Lit::Float(_) => last_name(ty).is_some_and(|name| name == "f64"),
        Lit::Bool(_) => last_name(ty).is_some_and(|name| name == "bool"),
        Lit::Int(_) => matches!(ty.to_token_stream().to_string().as_str(), "usize" | "u64" | "u32" | "i64"),
        _ => false,
    }
}
