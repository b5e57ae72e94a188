; Installer for Windows by Inno Setup 6, from out\bundle\iibr: iscc /DVersion=0.1.0 packaging\windows\iibr.iss
; It needs no administrator, takes over no file type, and leaves preferences, models and saved files where they are.

#ifndef Version
  #error name the version: iscc /DVersion=0.1.0 packaging\windows\iibr.iss
#endif
#define Address "https://github.com/iibr/iibr"
#define Window "iibr-window.exe"

[Setup]
AppId=io.github.iibr.iibr
AppName=iibr
AppVersion={#Version}
AppVerName=iibr {#Version}
AppPublisher=iibr
AppPublisherURL={#Address}
AppSupportURL={#Address}/issues
AppUpdatesURL={#Address}/releases
VersionInfoVersion={#Version}
LicenseFile=..\..\LICENSE
DefaultDirName={autopf}\iibr
DisableProgramGroupPage=yes
PrivilegesRequired=lowest
ArchitecturesAllowed=x64compatible
ArchitecturesInstallIn64BitMode=x64compatible
MinVersion=10.0
ChangesAssociations=yes
SetupIconFile=..\..\out\bundle-work\iibr\iibr.ico
UninstallDisplayIcon={app}\{#Window}
OutputDir=..\..\dist
OutputBaseFilename=iibr-{#Version}-windows-x64
Compression=lzma2
SolidCompression=yes
WizardStyle=modern

[Files]
Source: "..\..\out\bundle\iibr\*"; DestDir: "{app}"; Flags: ignoreversion recursesubdirs

; What an earlier version had and this one has not would be found by imports.
[InstallDelete]
Type: filesandordirs; Name: "{app}\_internal"

[Tasks]
Name: desktop; Description: "{cm:CreateDesktopIcon}"; Flags: unchecked

[Icons]
Name: "{autoprograms}\iibr"; Filename: "{app}\{#Window}"; Parameters: "open"
Name: "{autodesktop}\iibr"; Filename: "{app}\{#Window}"; Parameters: "open"; Tasks: desktop

[Run]
Filename: "{app}\{#Window}"; Parameters: "open"; Description: "{cm:LaunchProgram,iibr}"; Flags: nowait postinstall skipifsilent

; "Open with" of the file manager lists iibr for photos; the program that opens them by a double click stays.
[Registry]
Root: HKA; Subkey: "Software\Classes\iibr.Photo"; ValueType: string; ValueData: "Photo"; Flags: uninsdeletekey
Root: HKA; Subkey: "Software\Classes\iibr.Photo\shell\open"; ValueName: "FriendlyAppName"; ValueType: string; ValueData: "iibr"
Root: HKA; Subkey: "Software\Classes\iibr.Photo\shell\open\command"; ValueType: string; ValueData: """{app}\{#Window}"" open ""%1"""
#define Endings ".jpg .jpeg .png .tif .tiff .webp .heic .heif .hif .avif .jxl .mpo .jps .pns .exr "
#define Ending() Local[0] = Copy(Endings, 1, Pos(" ", Endings) - 1), Endings = Copy(Endings, Pos(" ", Endings) + 1), Local[0]
#sub OpenWith
Root: HKA; Subkey: "Software\Classes\{#Ending()}\OpenWithProgids"; ValueName: "iibr.Photo"; ValueType: string; ValueData: ""; Flags: uninsdeletevalue
#endsub
#for {0; Len(Endings) > 0; 0} OpenWith
