// The client of `gradus lsp`: everything that the editor shows comes from there.

import * as vscode from "vscode";
import { LanguageClient, type LanguageClientOptions, type ServerOptions } from "vscode-languageclient/node";

let client: LanguageClient | undefined;

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  context.subscriptions.push(
    vscode.commands.registerCommand("gradus.restart", restart),
    vscode.workspace.onDidChangeConfiguration((event) => {
      if (event.affectsConfiguration("gradus")) void restart();
    }),
  );
  await start();
}

export function deactivate(): Promise<void> | undefined {
  return client?.stop();
}

async function restart(): Promise<void> {
  await client?.stop();
  await start();
}

async function start(): Promise<void> {
  const settings = vscode.workspace.getConfiguration("gradus");
  const command = settings.get<string>("path", "gradus");
  const server: ServerOptions = { command, args: ["lsp"] };
  const watcher = vscode.workspace.createFileSystemWatcher("**/{*.tmc,*.inc,gradus.toml}");
  const options: LanguageClientOptions = {
    documentSelector: [{ language: "tmcl" }],
    synchronize: { fileEvents: watcher },
    initializationOptions: {
      addresses: settings.get<boolean>("showAddresses", false),
      codeLens: settings.get<boolean>("codeLens", false),
    },
  };
  client = new LanguageClient("gradus", "TMCL", server, options);
  try {
    await client.start();
  } catch (error) {
    const reason = error instanceof Error ? error.message : String(error);
    void vscode.window.showErrorMessage(
      `The language server \`${command} lsp\` does not start: ${reason}. Install gradus, or set "gradus.path".`,
    );
  }
}
