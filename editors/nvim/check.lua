-- Runs in a headless Neovim: opens a program, and prints what `gradus lsp` shows of it.
--
--   GRADUS=target/release/gradus nvim --headless --clean -l editors/nvim/check.lua FILE       Neovim 0.9 and later
--   GRADUS=... nvim --headless --clean FILE -c 'luafile editors/nvim/check.lua'               Neovim 0.7
--
-- Prints one line a diagnostic, then hover and completion at the first ROR; leaves with 0 when all three came.

local function finish(status)
  io.stdout:flush()
  vim.cmd(status .. "cquit")
end

local function fail(message)
  io.stdout:write(message .. "\n")
  finish(1)
end

local client = vim.lsp.start_client({
  name = "gradus",
  cmd = { vim.env.GRADUS or "gradus", "lsp" },
  root_dir = vim.fn.expand("%:p:h"),
})
if not client then
  fail("the server does not start")
end
vim.lsp.buf_attach_client(0, client)

if not vim.wait(20000, function() return #vim.diagnostic.get(0) > 0 end, 20) then
  fail("no diagnostics")
end
for _, found in ipairs(vim.diagnostic.get(0)) do
  io.stdout:write(("%d:%d %s\n"):format(found.lnum + 1, found.col + 1, vim.split(found.message, "\n")[1]))
end

local function ask(method, line, character)
  local params = { textDocument = { uri = vim.uri_from_bufnr(0) }, position = { line = line, character = character } }
  local answer = (vim.lsp.buf_request_sync(0, method, params, 20000) or {})[client]
  if not answer or not answer.result then
    fail("no answer to " .. method)
  end
  return answer.result
end

for number, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, false)) do
  local start = line:find("ROR")
  if start then
    local hover = ask("textDocument/hover", number - 1, start)
    io.stdout:write("hover: " .. vim.split(hover.contents.value, "\n")[2] .. "\n")
    local items = ask("textDocument/completion", number - 1, #line)
    io.stdout:write("completion: " .. items[1].label .. "\n")
    finish(0)
  end
end
fail("no ROR in the program")
