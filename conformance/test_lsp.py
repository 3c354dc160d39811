"""`gradus lsp` with clients that others wrote: pytest-lsp, and Debian's Neovim."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
import pytest_lsp
from lsprotocol import types
from pytest_lsp import ClientServerConfig, LanguageClient

ROOT = Path(__file__).resolve().parent.parent
GRADUS = ROOT / "target/release/gradus"
PROGRAM = """\
Speed = 100
    ROR 0, 100
    ROR 0, Sped
    STOP
"""


@pytest_lsp.fixture(config=ClientServerConfig(server_command=[str(GRADUS), "lsp"]))
async def client(lsp_client: LanguageClient):
    await lsp_client.initialize_session(
        types.InitializeParams(capabilities=types.ClientCapabilities(), root_uri=ROOT.as_uri())
    )
    yield
    await lsp_client.shutdown_session()


def opened(client, uri="file:///stage/a.tmc", text=PROGRAM, version=1):
    document = types.TextDocumentItem(uri=uri, language_id="tmcl", version=version, text=text)
    client.text_document_did_open(types.DidOpenTextDocumentParams(text_document=document))
    return types.TextDocumentIdentifier(uri=uri)


@pytest.mark.asyncio
async def test_problems_come_and_go(client: LanguageClient):
    document = opened(client)
    await client.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    found = {item.code: item.range.start.line for item in client.diagnostics[document.uri]}
    assert found == {"unused-constant": 0, "unknown-name": 2}
    place = types.Range(start=types.Position(2, 11), end=types.Position(2, 15))
    client.text_document_did_change(
        types.DidChangeTextDocumentParams(
            text_document=types.VersionedTextDocumentIdentifier(version=2, uri=document.uri),
            content_changes=[types.TextDocumentContentChangePartial(range=place, text="Speed")],
        )
    )
    await client.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    assert not client.diagnostics[document.uri]


@pytest.mark.asyncio
async def test_hover_completion_definition_and_symbols(client: LanguageClient):
    document = opened(client)
    at = types.Position(1, 5)
    hover = await client.text_document_hover_async(types.HoverParams(text_document=document, position=at))
    assert "rotate right" in hover.contents.value.lower()
    items = await client.text_document_completion_async(
        types.CompletionParams(text_document=document, position=types.Position(2, 11))
    )
    assert "Speed" in {item.label for item in items}
    symbols = await client.text_document_document_symbol_async(types.DocumentSymbolParams(text_document=document))
    assert [symbol.name for symbol in symbols] == ["Speed"]


@pytest.mark.asyncio
async def test_formatting_and_renaming(client: LanguageClient):
    document = opened(client, text="a=1\nror 0,a//fast\nstop\n")
    options = types.FormattingOptions(tab_size=4, insert_spaces=True)
    edits = await client.text_document_formatting_async(
        types.DocumentFormattingParams(text_document=document, options=options)
    )
    assert "    ROR 0, a" in "".join(edit.new_text for edit in edits)
    change = await client.text_document_rename_async(
        types.RenameParams(text_document=document, position=types.Position(0, 0), new_name="Fast")
    )
    assert len(change.changes[document.uri]) == 2


@pytest.mark.skipif(not shutil.which("nvim"), reason="LEFT OUT: nvim is not installed (apt install neovim)")
def test_neovim_shows_diagnostics_hover_and_completion(tmp_path):
    program = tmp_path / "a.tmc"
    program.write_text(PROGRAM)
    command = ["nvim", "--headless", "--clean", program, "-c", f"luafile {ROOT}/editors/nvim/check.lua"]
    environment = {**os.environ, "GRADUS": str(GRADUS)}
    done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines() == [
        "1:1 nothing uses the constant `Speed`",
        "3:12 no label or constant named `Sped`",
        "hover: ROR <axis>, <velocity>",
        "completion: Speed",
    ], done.stderr
    assert done.returncode == 0
