"""The studio: a machine file changed and answered in the browser, with truepose behind the page.

The core is pure: `settings` are the state, `edited_file` makes of them the text that is evaluated,
`answers` and `tabs` answer it, `fields` shows it; `shared_state` takes messages and says what to
tell. Around it `evaluation` runs answers in a process of its own, and `server` is the only module
that knows the network. `docs/studio.md` describes the messages.
"""
