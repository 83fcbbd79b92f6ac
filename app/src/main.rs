//! The window.

use sinew_app::App;
use sinew_app::state::State;
use std::sync::Arc;

fn main() -> eframe::Result {
    let file = std::env::args_os().nth(1);
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size([1440.0, 900.0]).with_title("sinew"),
        ..Default::default()
    };
    eframe::run_native(
        "sinew-app",
        options,
        Box::new(move |cc| {
            let import = file.map(|f| sinew::io::import(f.as_ref(), &sinew::io::Options { textures: true }));
            let (asset, notice) = match import.transpose() {
                Ok(import) => (import.map(|i| i.asset).unwrap_or_default(), None),
                Err(e) => (Default::default(), Some(e.to_string())),
            };
            sinew_app::set_up(&cc.egui_ctx);
            let mut app = App::new(State::open(Arc::new(asset)));
            cc.storage.into_iter().for_each(|s| app.restore(s));
            notice.into_iter().for_each(|n| app.tell(n));
            Ok(Box::new(app))
        }),
    )
}
